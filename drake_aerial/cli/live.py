"""Options of the verbs that can show in Meshcat what they do."""

from __future__ import annotations

import argparse

from drake_aerial.cli.progress import say
from drake_aerial.errors import InputError


def add_live(verb: argparse.ArgumentParser, meaning: str) -> None:
    """Add ``--live`` and what belongs to it."""
    verb.add_argument("--live", action="store_true", help=meaning)
    verb.add_argument(
        "--port",
        type=int,
        help="of Meshcat on this machine (default: the first free one from 7000)",
    )
    verb.add_argument("--no-browser", action="store_true", help="only say where Meshcat is")


def live_is_wanted(arguments: argparse.Namespace) -> bool:
    """Return whether Meshcat is wanted.

    Raises
    ------
    InputError
        If it is not, and its options are given.
    """
    if not arguments.live and (arguments.port is not None or arguments.no_browser):
        raise InputError("--port and --no-browser belong to --live")
    return bool(arguments.live)


def tell_address(url: str) -> None:
    """Say where Meshcat is."""
    say(f"Meshcat is at {url} (Ctrl-C: stop)")
