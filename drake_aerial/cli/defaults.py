"""The command ``defaults``: print the default configuration of a component."""

import argparse
from pathlib import Path

from drake_aerial.choices import CABLES, CONTROLLERS
from drake_aerial.configuration import NOUNS


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "defaults",
        help="print the default configuration of a component, with meanings and units",
        description="Print the default configuration of a component as YAML; keep only the keys "
        "you change. The file is read by learn --parameters (learning, which includes features and "
        "bandwidths), transfer --parameters (transfer), and by fly --station (station), "
        "--quadrotor, --cable, --gripper, --wind, --controller and --payload.",
    )
    command.add_argument("noun", metavar="COMPONENT", help=", ".join(NOUNS))
    command.add_argument(
        "--kind",
        metavar="KIND",
        help=f"kind of controller ({', '.join(CONTROLLERS)}) or cable ({', '.join(CABLES)})",
    )
    command.add_argument(
        "--out", type=Path, metavar="FILE.yaml", help="write a file instead of printing"
    )
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the defaults, or write them to a file."""
    from drake_aerial.configuration import defaults_text
    from drake_aerial.io.files import write_text

    text = defaults_text(arguments.noun, arguments.kind)
    if arguments.out is None:
        print(text, end="")
    else:
        write_text(arguments.out, text)
        print(f"-> {arguments.out}")
    return 0
