"""The verb ``study``: fly a study, or go on with one."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from drake_aerial.cli.answer import answer
from drake_aerial.cli.arguments import add_json, positive_number, whole_number
from drake_aerial.cli.progress import progress_bar, progress_log, say


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser(
        "study",
        help="fly a study: conditions x methods x solutions x trials; goes on where it stopped",
    )
    verb.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="where records and report go"
    )
    verb.add_argument(
        "--plan", default="paper", metavar="NAME|FILE", help="the study (default: paper)"
    )
    verb.add_argument(
        "--conditions", nargs="+", metavar="NAME", help="of the plan's conditions (default: all)"
    )
    verb.add_argument(
        "--methods", nargs="+", metavar="NAME", help="of the plan's methods (default: all)"
    )
    verb.add_argument(
        "--beliefs", nargs="+", metavar="NAME", help="of the plan's beliefs (default: all)"
    )
    verb.add_argument(
        "--solutions",
        type=positive_number,
        metavar="N",
        help="fly the best N (default: the plan's)",
    )
    verb.add_argument(
        "--trials", type=positive_number, metavar="N", help="fly each N times (default: the plan's)"
    )
    verb.add_argument(
        "--seed", type=whole_number, help="all others derive from it (default: the plan's)"
    )
    verb.add_argument(
        "--fly-infeasible", action="store_true", help="also fly solutions with reasons against them"
    )
    where = verb.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=whole_number,
        metavar="N",
        help="processes; 0: in this one (default: one per core)",
    )
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help="a Dask scheduler, instead of local processes"
    )
    add_json(verb, "a summary")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the study and rebuild its report; fail where a flight could not be judged."""
    from drake_aerial import StudyPlan, run_study
    from drake_aerial.study.report.study_report import write_report
    from drake_aerial.study.workers import default_workers

    plan = StudyPlan.read(arguments.plan).chosen(
        conditions=arguments.conditions,
        methods=arguments.methods,
        beliefs=arguments.beliefs,
        solutions=arguments.solutions,
        trials=arguments.trials,
        seed=arguments.seed,
        fly_infeasible=arguments.fly_infeasible or None,
    )
    workers = default_workers() if arguments.workers is None else arguments.workers
    where = (
        f"at {arguments.scheduler}"
        if arguments.scheduler
        else f"{workers} workers"
        if workers
        else "in this process"
    )
    say(f"study {plan.name!r}: {plan.count} flights at most, {where}")
    with progress_bar("study") as bar:
        progress = bar if sys.stderr.isatty() else progress_log("study")
        summary = run_study(
            plan, arguments.out, workers=workers, scheduler=arguments.scheduler, progress=progress
        )
        report = write_report(arguments.out, progress=progress) if summary.outcomes else None
    for complaint in (*summary.complaints, *summary.errors):
        say(f"drake-aerial study: {complaint}")
    answer(
        arguments.json,
        summary.to_dict(),
        f"{summary}\n{report or 'no report: there are no records'}",
    )
    return 1 if summary.errors else 0
