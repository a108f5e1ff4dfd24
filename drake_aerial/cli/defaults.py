"""The verb ``defaults``: a noun's configuration file with all its defaults."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_aerial.configuration import NOUNS


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "defaults",
        help="print a configuration file with all defaults, what they mean and their units",
        description="Print the YAML file of a noun with all its defaults; keep of it what you change. It is read by learn --parameters "
        "(learning; features and bandwidths are parts of it), transfer --parameters (transfer), and fly --station (station), --quadrotor, --cable, "
        "--gripper, --wind, --controller and --payload.",
    )
    verb.add_argument("noun", metavar="NOUN", help=", ".join(NOUNS))
    verb.add_argument(
        "--kind",
        metavar="KIND",
        help="of a controller (mpc, geometric_ff, geometric) or cable (inextensible, elastic)",
    )
    verb.add_argument("--out", type=Path, metavar="FILE.yaml", help="write a file instead")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the defaults, or write them."""
    from drake_aerial.configuration import defaults_text
    from drake_aerial.io.files import write_text

    text = defaults_text(arguments.noun, arguments.kind)
    if arguments.out is None:
        print(text, end="")
    else:
        write_text(arguments.out, text)
        print(f"-> {arguments.out}")
    return 0
