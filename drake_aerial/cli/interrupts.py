"""Ctrl-C as one clean end of a command, whatever it is doing."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_AGAIN = 0.05


class _Asked:
    """How often this process was asked to stop; signals are a process's own."""

    times = 0


def heed() -> None:
    """Raise the KeyboardInterrupt that was lost on its way: extensions drop the one that falls into the conversion of their arguments."""
    if _Asked.times:
        raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[None]:
    """Turn Ctrl-C into one KeyboardInterrupt, later where a module is being imported: extensions die of it there.

    Those that follow while the command cleans up are ignored, but the third ends the process at once. An error that an interrupt became
    on its way is the interrupt.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _Asked.times = 0

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _importing(frame):
            threading.Timer(_AGAIN, os.kill, (os.getpid(), signal.SIGINT)).start()
            return
        _Asked.times += 1
        if _Asked.times == 1:
            raise KeyboardInterrupt
        if _Asked.times > 2:
            os._exit(130)

    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:  # in the background, where Ctrl-C is meant for others
        yield
        return
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    except Exception:
        heed()
        raise
    finally:
        signal.signal(signal.SIGINT, before)
        _Asked.times = 0


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False
