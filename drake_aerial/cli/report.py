"""The command ``report``: write the figures and page of a study from its records."""

import argparse
from pathlib import Path

from drake_aerial.cli.output import progress_bar


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "report",
        help="write the figures and report.html of a study from its records",
        description="Write the figures and report.html of a study from its records.",
    )
    command.add_argument(
        "folder", type=Path, metavar="DIR", help="a study's folder, which holds records.jsonl"
    )
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the report and print its path."""
    from drake_aerial.study.report.study_report import write_report

    with progress_bar("report") as progress:
        summary = write_report(arguments.folder, progress=progress)
    print(summary)
    return 0
