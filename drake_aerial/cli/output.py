"""Output of the commands: results on stdout, progress and messages on stderr."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


def print_result(as_json: bool, document: dict[str, Any], text: str) -> None:
    """Print the document as one line of JSON, or the text."""
    print(json.dumps(document) if as_json else text)


def say(line: str) -> None:
    """Write a line to stderr in one piece, so that other output cannot split it."""
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


def say_assumptions(record: dict[str, Any]) -> None:
    """Write what was assumed about a scan to stderr, one line each, from the scan's record."""
    for assumption in record.get("assumptions", []):
        say(f"assumed {assumption['kind']}: {assumption['text']}")


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[float, str], None]]:
    """Yield a callback that takes the fraction done and the current step.

    It draws a bar on stderr if that is a terminal.
    """
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
            bar.set_description_str(what or label, refresh=False)
            bar.n = 100.0 * min(max(fraction, 0.0), 1.0)
            bar.refresh()

        yield update


def progress_log(label: str, every: float = 60.0) -> Callable[[float, str], None]:
    """Return a callback that writes a line to stderr every `every` seconds, for logs."""
    last = 0.0

    def update(fraction: float, what: str = "") -> None:
        nonlocal last
        if time.monotonic() - last >= every:
            last = time.monotonic()
            say(f"{label}: {100 * fraction:.0f} %, {what}")

    return update
