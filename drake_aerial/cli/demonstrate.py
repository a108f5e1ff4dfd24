"""The verb ``demonstrate``: a demonstration by clicks in the browser, or by positions."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_aerial.cli.arguments import add_scan, scan_of
from drake_aerial.cli.progress import say


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "demonstrate",
        help="make a demonstration: click contacts on a cloud in the browser, or give them with --at",
    )
    add_scan(verb)
    verb.add_argument("--out", type=Path, required=True, metavar="DEMONSTRATION.yaml")
    verb.add_argument(
        "--at",
        type=float,
        nargs=3,
        action="append",
        metavar=("X", "Y", "Z"),
        help="a contact [m], instead of the browser; once for each gripper",
    )
    verb.add_argument("--cable-length", type=float, default=0.5, metavar="M", help="(default: 0.5)")
    verb.add_argument("--name", help="of the demonstration (default: the file's)")
    verb.add_argument(
        "--port", type=int, default=0, help="of the page on this machine (default: a free one)"
    )
    verb.add_argument("--no-browser", action="store_true", help="only say where the page is")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Take the contacts and write the demonstration."""
    from drake_aerial.annotation.draft import DemonstrationDraft
    from drake_aerial.annotation.server import demonstrate

    cloud = scan_of(arguments)
    cloud.require_up()
    draft = DemonstrationDraft(cloud, cloud.path)
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
