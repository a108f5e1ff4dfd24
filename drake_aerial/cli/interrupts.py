"""Ctrl-C as one clean end of a command, whatever it is doing."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_AGAIN = 0.05


@contextmanager
def interruptible() -> Iterator[None]:
    """Turn Ctrl-C into one KeyboardInterrupt, later where a module is being imported: extensions die of it there.

    Those that follow while the command cleans up are ignored, but the third ends the process at once.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked = 0

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if _importing(frame):
            threading.Timer(_AGAIN, os.kill, (os.getpid(), signal.SIGINT)).start()
            return
        asked += 1
        if asked == 1:
            raise KeyboardInterrupt
        if asked > 2:
            os._exit(130)

    before = signal.getsignal(signal.SIGINT)
    if before is signal.SIG_IGN:  # in the background, where Ctrl-C is meant for others
        yield
        return
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False
