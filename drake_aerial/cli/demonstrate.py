"""The command ``demonstrate``: define a demonstration by clicks in the browser, or by positions."""

import argparse
from pathlib import Path

from drake_aerial.cli.arguments import AXES, add_object, add_scan, object_of
from drake_aerial.cli.output import say


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "demonstrate",
        help="define a demonstration: click contacts on a cloud in the browser, or give positions",
        description="Define a demonstration: click contacts on a cloud in the browser, or give "
        "their positions with --at.",
    )
    add_scan(command)
    add_object(command, at=False)
    command.add_argument(
        "--out", type=Path, required=True, metavar="DEMONSTRATION.yaml", help="file to write"
    )
    command.add_argument(
        "--at",
        type=float,
        nargs=3,
        action="append",
        metavar=AXES,
        help="position of a contact [m], instead of a click; repeat for each gripper",
    )
    command.add_argument(
        "--cable-length",
        type=float,
        default=0.5,
        metavar="M",
        help="cable length [m] (default: 0.5)",
    )
    command.add_argument("--name", help="name of the demonstration (default: the file's name)")
    command.add_argument(
        "--port", type=int, default=0, help="port of the page (default: a free one)"
    )
    command.add_argument(
        "--no-browser", action="store_true", help="print the page's URL and open no browser"
    )
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Take the contacts and write the demonstration."""
    from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
    from drake_aerial.annotation.demonstration_server import demonstrate

    chosen = arguments.object or arguments.pixel or arguments.whole
    contact = None if chosen or arguments.at is None else arguments.at[0]
    cloud = object_of(arguments, contact)
    cloud.require_up()
    draft = DemonstrationDraft(cloud, cloud.path, whole=arguments.whole)
    if arguments.at is None:
        out = demonstrate(
            draft,
            arguments.out,
            name=arguments.name,
            cable_length=arguments.cable_length,
            port=arguments.port,
            open_browser=not arguments.no_browser,
            tell=lambda url: say(f"click the contacts at {url} (Ctrl-C: give up)"),
        )
    else:
        demonstration = draft.demonstration(
            arguments.at,
            cable_length=arguments.cable_length,
            name=arguments.name or arguments.out.stem,
        )
        out = draft.write(arguments.out, demonstration)
        for touch in map(draft.touch, demonstration.grippers.p):
            where = " ".join(f"{x:+.3f}" for x in touch.position)
            print(f"contact at {where} m touches: {touch.surface} ({touch.features} features)")
    print(f"-> {out}")
    return 0
