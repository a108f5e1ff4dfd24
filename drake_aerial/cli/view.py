"""The verb ``view``: a file as one page, or live in Meshcat."""

from __future__ import annotations

import argparse
import time
from contextlib import suppress
from pathlib import Path

from drake_aerial.cli.live import add_live, live_is_wanted, tell_address
from drake_aerial.errors import InputError


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "view", help="show a cloud, skill, contacts or trial as one self-contained HTML page"
    )
    verb.add_argument(
        "file", type=Path, metavar="FILE", help="a cloud, SKILL.npz, contacts.json or trial.npz"
    )
    verb.add_argument(
        "--out", type=Path, metavar="PAGE.html", help="the page (default: FILE with .html)"
    )
    verb.add_argument(
        "--skill",
        metavar="SKILL",
        help="what contacts were found with, for their heat (default: the shipped one so named)",
    )
    add_live(verb, "show it in Meshcat until Ctrl-C, instead of writing a page")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the page and print where it is; or serve it."""
    from drake_aerial.named_inputs import read_skill
    from drake_aerial.visualization.views import write_view

    skill = None if arguments.skill is None else read_skill(arguments.skill)
    if not live_is_wanted(arguments):
        # The folder that one is in has no name.
        beside = arguments.file.with_suffix(".html") if arguments.file.name else Path("view.html")
        print(write_view(arguments.file, arguments.out or beside, skill=skill))
        return 0
    if arguments.out is not None:
        raise InputError("--live writes no page: give --out or --live")
    from drake_aerial.visualization.live import live_view

    view = live_view(
        arguments.file, skill=skill, port=arguments.port, open_browser=not arguments.no_browser
    )
    # How a server is ended is no failure, from the moment on that somebody can know of it.
    with view as url, suppress(KeyboardInterrupt):
        tell_address(url)
        while True:
            time.sleep(0.5)
    return 0
