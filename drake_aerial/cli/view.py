"""The verb ``view``: a file as one page."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser("view", help="show a cloud, skill, contacts or trial as one self-contained HTML page")
    verb.add_argument("file", type=Path, metavar="FILE", help="a cloud, SKILL.npz, contacts.json or trial.npz")
    verb.add_argument("--out", type=Path, metavar="PAGE.html", help="the page (default: FILE with .html)")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the page and print where it is."""
    from drake_aerial.drawing.views import write_view

    out = arguments.out or arguments.file.with_suffix(".html")
    print(write_view(arguments.file, out))
    return 0
