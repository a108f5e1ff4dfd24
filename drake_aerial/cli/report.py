"""The verb ``report``: a study's figures and page from its records."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_aerial.cli.progress import progress_bar


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "report", help="rebuild a study's figures and report.html from its records"
    )
    verb.add_argument(
        "folder", type=Path, metavar="DIR", help="a study's folder, with its records.jsonl"
    )
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the report and print where it is."""
    from drake_aerial.study.report.study_report import write_report

    with progress_bar("report") as progress:
        summary = write_report(arguments.folder, progress=progress)
    print(summary)
    return 0
