"""The verb ``demo``: the main job from start to end, in one folder."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_aerial.cli.arguments import add_seed
from drake_aerial.cli.progress import progress_bar


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "demo",
        help="the main job, start to end: one demonstration, a new scan, two flights, a report",
    )
    verb.add_argument(
        "--out",
        type=Path,
        default=Path("demo_out"),
        metavar="DIR",
        help="where the files go (default: demo_out)",
    )
    add_seed(verb)
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the main job and print its summary."""
    from drake_aerial.demo import run_demo

    with progress_bar("demo") as progress:
        summary = run_demo(arguments.out, seed=arguments.seed, progress=progress)
    print(summary)
    return 0
