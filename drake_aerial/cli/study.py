"""The command ``study``: run a study, or resume it."""

import argparse
import sys
from pathlib import Path

from drake_aerial.cli.arguments import add_json, whole_number
from drake_aerial.cli.output import print_result, progress_bar, progress_log, say


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "study",
        help="run a study (conditions x methods x solutions x trials); resumes if interrupted",
        description="Run a study (conditions x methods x solutions x trials) and write its report. "
        "If the run is interrupted, the same command resumes it.",
    )
    command.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder of records and report"
    )
    command.add_argument(
        "--plan",
        default="paper",
        metavar="NAME|FILE",
        help="a shipped study or a YAML file (default: paper)",
    )
    command.add_argument(
        "--conditions",
        nargs="+",
        metavar="NAME",
        help="conditions to run (default: all of the plan)",
    )
    command.add_argument(
        "--methods", nargs="+", metavar="NAME", help="methods to run (default: all of the plan)"
    )
    command.add_argument(
        "--beliefs", nargs="+", metavar="NAME", help="beliefs to run (default: all of the plan)"
    )
    command.add_argument(
        "--solutions",
        type=whole_number(1),
        metavar="N",
        help="fly the best N solutions (default: the plan's)",
    )
    command.add_argument(
        "--trials",
        type=whole_number(1),
        metavar="N",
        help="trials of each solution (default: the plan's)",
    )
    command.add_argument(
        "--seed", type=whole_number(0), metavar="N", help="master seed (default: the plan's)"
    )
    command.add_argument(
        "--fly-infeasible", action="store_true", help="also fly infeasible solutions"
    )
    where = command.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=whole_number(0),
        metavar="N",
        help="worker processes; 0: none, run here (default: one per core)",
    )
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="address of a Dask scheduler, instead of local processes",
    )
    add_json(command, "a summary")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the study and write its report. Fail if a flight raised an error."""
    from drake_aerial import StudyPlan, run_study
    from drake_aerial.study.executors import default_workers
    from drake_aerial.study.report.study_report import write_report

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
    print_result(
        arguments.json,
        summary.to_dict(),
        f"{summary}\n{report or 'no report: there are no records'}",
    )
    return 1 if summary.errors else 0
