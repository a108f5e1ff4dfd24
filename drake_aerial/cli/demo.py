"""The command ``demo``: the whole method on one example, in one folder."""

import argparse
from pathlib import Path

from drake_aerial.cli.arguments import add_seed
from drake_aerial.cli.output import progress_bar


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "demo",
        help="run an example: learn from a demonstration, transfer, fly twice, report",
        description="Run an example: learn from a demonstration, transfer to a new scan, fly "
        "twice, and write a report.",
    )
    command.add_argument(
        "--out",
        type=Path,
        default=Path("demo_out"),
        metavar="DIR",
        help="output folder (default: demo_out)",
    )
    add_seed(command)
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the example and print its summary."""
    from drake_aerial.demo import run_demo

    with progress_bar("demo") as progress:
        summary = run_demo(arguments.out, seed=arguments.seed, progress=progress)
    print(summary)
    return 0
