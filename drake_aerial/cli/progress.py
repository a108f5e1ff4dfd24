"""How far a job is, on stderr: a bar on a terminal, a line now and then in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drake_aerial.cli.interrupts import heed


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[float, str], None]]:
    """Yield a callback that takes the fraction done and what is being done; a bar on stderr where that is a terminal."""
    from tqdm import tqdm

    with tqdm(
        total=100,
        desc=label,
        leave=False,
        file=sys.stderr,
        disable=None,
        bar_format="{desc:<28.28} {percentage:3.0f}% |{bar}| {elapsed}",
    ) as bar:

        def update(fraction: float, what: str = "") -> None:
            heed()
            bar.set_description_str(what or label, refresh=False)
            bar.n = 100.0 * min(max(fraction, 0.0), 1.0)
            bar.refresh()

        yield update


def progress_log(label: str, every: float = 60.0) -> Callable[[float, str], None]:
    """Return a callback that writes a line on stderr now and then [s], for long jobs without a terminal."""
    told = 0.0

    def update(fraction: float, what: str = "") -> None:
        nonlocal told
        heed()
        if time.monotonic() - told >= every:
            told = time.monotonic()
            say(f"{label}: {100 * fraction:.0f} %, {what}")

    return update


def say(line: str) -> None:
    """Write a line on stderr, in one piece: what an interrupt has said after it begins on a line of its own."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()
