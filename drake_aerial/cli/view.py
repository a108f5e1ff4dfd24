"""The command ``view``: show a file as one HTML page, or in Meshcat."""

import argparse
import time
from contextlib import suppress
from pathlib import Path

from drake_aerial.cli.arguments import add_live, live_is_wanted
from drake_aerial.cli.output import say
from drake_aerial.errors import InputError


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "view",
        help="show a cloud, skill, contacts or trial as one self-contained HTML page",
        description="Show a cloud, skill, contacts or trial as one self-contained HTML page, or in "
        "Meshcat (--live).",
    )
    command.add_argument(
        "file", type=Path, metavar="FILE", help="a cloud, SKILL.npz, contacts.json or trial.npz"
    )
    command.add_argument(
        "--out", type=Path, metavar="PAGE.html", help="page to write (default: FILE with .html)"
    )
    command.add_argument(
        "--skill",
        metavar="SKILL",
        help="skill for the heat map of contacts (default: the shipped one of that name)",
    )
    add_live(command, "show it in Meshcat until Ctrl-C, instead of writing a page")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the page and print its path, or serve it."""
    from drake_aerial.named_inputs import read_skill
    from drake_aerial.visualization.file_view import write_view

    skill = None if arguments.skill is None else read_skill(arguments.skill)
    if not live_is_wanted(arguments):
        # The current folder "." has no name.
        default = arguments.file.with_suffix(".html") if arguments.file.name else Path("view.html")
        print(write_view(arguments.file, arguments.out or default, skill=skill))
        return 0
    if arguments.out is not None:
        raise InputError("--out and --live exclude each other: --live writes no page")
    from drake_aerial.visualization.live_view import live_view

    view = live_view(
        arguments.file, skill=skill, port=arguments.port, open_browser=not arguments.no_browser
    )
    # Ctrl-C is the normal way to stop the server.
    with view as url, suppress(KeyboardInterrupt):
        say(f"Meshcat: {url} (Ctrl-C: stop)")
        while True:
            time.sleep(0.5)
    return 0
