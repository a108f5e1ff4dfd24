"""The command line: thin, every verb reads its arguments and calls one public function.

Results go to files; stdout carries one line of JSON with ``--json``, a short summary otherwise; errors and progress go to
stderr. Exit codes: 0 done, 1 the job ran and failed, 2 bad input or usage, 130 interrupted.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_aerial import __version__
from drake_aerial.errors import InputError, JobError

if TYPE_CHECKING:
    from drake_aerial.transferring.solutions import ContactSolutions

METHODS = ("task", "paper", "kopicki", "centroid")
BELIEFS = ("below_contact", "geometric", "true")
CONTROLLERS = ("mpc", "geometric_ff", "geometric")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit code."""
    arguments = _parser().parse_args(argv)
    try:
        return arguments.run(arguments)
    except InputError as error:
        print(f"drake-aerial {arguments.verb}: {_one_line(error)}", file=sys.stderr)
        return 2
    except JobError as error:
        print(f"drake-aerial {arguments.verb}: {_one_line(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(f"drake-aerial {arguments.verb}: interrupted; nothing was half-written", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our stdout left; Python would complain once more when it flushes.
        sys.stderr.close()
        return 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="drake-aerial",
        description="Learn where grippers belong from one demonstration, transfer it to an unknown payload, fly it in Drake.",
    )
    parser.add_argument("--version", action="version", version=f"drake-aerial {__version__}")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)

    demo = verbs.add_parser(
        "demo", help="the main job, start to end: one demonstration, a new scan, two flights, a report"
    )
    demo.add_argument(
        "--out",
        type=Path,
        default=Path("demo_out"),
        metavar="DIR",
        help="where the files go (default: demo_out)",
    )
    demo.add_argument(
        "--seed", type=_seed, default=0, help="seed of the scan, the transfer and the flights (default: 0)"
    )
    demo.set_defaults(run=_demo)

    learn = verbs.add_parser("learn", help="learn a contact skill from one demonstration")
    learn.add_argument(
        "demonstration", metavar="DEMONSTRATION", help="a YAML file or the name of a shipped demonstration"
    )
    learn.add_argument("--out", type=Path, required=True, metavar="SKILL.npz")
    learn.add_argument("--seed", type=_seed, default=0)
    learn.add_argument("--json", action="store_true", help="print a JSON summary on stdout")
    learn.set_defaults(run=_learn)

    transfer = verbs.add_parser("transfer", help="find where the grippers go on a new scan")
    transfer.add_argument("skill", metavar="SKILL", help="a skill .npz, or the name of a shipped demonstration")
    transfer.add_argument(
        "cloud", metavar="CLOUD", help=".ply .pcd .obj .stl .npz .npy, or the name of a shipped payload"
    )
    transfer.add_argument("--out", type=Path, required=True, metavar="contacts.json")
    transfer.add_argument("--method", choices=METHODS, default="task")
    transfer.add_argument("--top", type=_positive, default=5, metavar="N", help="how many solutions (default: 5)")
    transfer.add_argument("--seed", type=_seed, default=0)
    transfer.add_argument("--viewpoint", type=float, nargs=3, metavar=("X", "Y", "Z"), help="where the sensor was [m]")
    transfer.add_argument(
        "--up",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 1.0),
        metavar=("X", "Y", "Z"),
        help="against gravity (default: 0 0 1)",
    )
    transfer.add_argument(
        "--mass",
        type=float,
        metavar="KG",
        help="also judge whether the paper's quadrotors lift a payload of this mass (default: its mass is not judged)",
    )
    transfer.add_argument(
        "--refine", action="store_true", help="improve each solution by a MathematicalProgram; never makes one worse"
    )
    transfer.add_argument("--html", type=Path, metavar="FILE", help="also write a page that shows the contacts")
    transfer.add_argument("--json", action="store_true", help="print the contacts as JSON on stdout")
    transfer.set_defaults(run=_transfer)

    demonstrate = verbs.add_parser(
        "demonstrate", help="make a demonstration: click contacts on a cloud in the browser, or give them with --at"
    )
    demonstrate.add_argument(
        "cloud", metavar="CLOUD", help=".ply .pcd .obj .stl .npz .npy, or the name of a shipped payload"
    )
    demonstrate.add_argument("--out", type=Path, required=True, metavar="DEMONSTRATION.yaml")
    demonstrate.add_argument(
        "--at",
        type=float,
        nargs=3,
        action="append",
        metavar=("X", "Y", "Z"),
        help="a contact [m], instead of the browser; once for each gripper",
    )
    demonstrate.add_argument("--cable-length", type=float, default=0.5, metavar="M", help="(default: 0.5)")
    demonstrate.add_argument("--name", help="of the demonstration (default: the file's)")
    demonstrate.add_argument(
        "--viewpoint", type=float, nargs=3, metavar=("X", "Y", "Z"), help="where the sensor was [m]"
    )
    demonstrate.add_argument(
        "--up", type=float, nargs=3, default=(0.0, 0.0, 1.0), metavar=("X", "Y", "Z"), help="against gravity"
    )
    demonstrate.add_argument("--port", type=int, default=0, help="of the page on this machine (default: a free one)")
    demonstrate.add_argument("--no-browser", action="store_true", help="only say where the page is")
    demonstrate.set_defaults(run=_demonstrate)

    fly = verbs.add_parser(
        "fly",
        help="fly one of the solutions of a transfer",
        description="Fly one of the solutions of a transfer. What is known not to fly is refused before take-off with its reason: exit code 1 "
        "for contacts (marked infeasible, no taut equilibrium, more than a quadrotor's share), 2 for a payload that the team cannot lift.",
    )
    fly.add_argument("contacts", type=Path, metavar="contacts.json")
    fly.add_argument("--out", type=Path, required=True, metavar="DIR")
    payload = fly.add_mutually_exclusive_group()
    payload.add_argument(
        "--payload",
        metavar="PAYLOAD",
        help="a YAML file or the name of a shipped payload (default: the scan's hull)",
    )
    payload.add_argument(
        "--mass", type=float, metavar="KG", help="mass of a payload known by its scan alone (default: 0.25)"
    )
    fly.add_argument("--solution", type=_positive, default=1, metavar="RANK")
    fly.add_argument("--seed", type=_seed, default=0)
    fly.add_argument(
        "--belief",
        choices=BELIEFS,
        default="below_contact",
        help="what the controller takes for the centre of mass",
    )
    fly.add_argument("--controller", choices=CONTROLLERS, default="mpc")
    fly.add_argument(
        "--trajectory",
        default="circle",
        metavar="NAME|FILE",
        help="a trajectory's name or YAML file (default: circle)",
    )
    fly.add_argument("--cable", choices=("inextensible", "elastic"), default="inextensible")
    fly.add_argument(
        "--force",
        action="store_true",
        help="fly also a solution marked infeasible, contacts by which no taut cables hold the payload, or too heavy a payload",
    )
    fly.add_argument("--graphviz", type=Path, metavar="FILE", help="also draw the diagram (.dot, or .svg, .png, .pdf)")
    fly.add_argument("--json", action="store_true", help="print the metrics as JSON on stdout")
    fly.set_defaults(run=_fly)

    study = verbs.add_parser(
        "study", help="fly a study: conditions x methods x solutions x trials; goes on where it stopped"
    )
    study.add_argument("--out", type=Path, required=True, metavar="DIR", help="where records and report go")
    study.add_argument("--plan", default="paper", metavar="NAME|FILE", help="the study (default: paper)")
    study.add_argument("--conditions", nargs="+", metavar="NAME", help="of the plan's conditions (default: all)")
    study.add_argument("--methods", nargs="+", metavar="NAME", help="of the plan's methods (default: all)")
    study.add_argument("--beliefs", nargs="+", metavar="NAME", help="of the plan's beliefs (default: all)")
    study.add_argument("--solutions", type=_positive, metavar="N", help="fly the best N (default: the plan's)")
    study.add_argument("--trials", type=_positive, metavar="N", help="fly each N times (default: the plan's)")
    study.add_argument("--seed", type=_seed, help="all others derive from it (default: the plan's)")
    study.add_argument("--fly-infeasible", action="store_true", help="also fly solutions with reasons against them")
    where = study.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=_seed,
        metavar="N",
        help="processes; 0: in this one (default: one per core)",
    )
    where.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, instead of local processes")
    study.add_argument("--json", action="store_true", help="print a JSON summary on stdout")
    study.set_defaults(run=_study)

    report = verbs.add_parser("report", help="rebuild a study's figures and report.html from its records")
    report.add_argument("folder", type=Path, metavar="DIR", help="a study's folder, with its records.jsonl")
    report.set_defaults(run=_write_study_report)

    view = verbs.add_parser("view", help="show a cloud, skill, contacts or trial as one self-contained HTML page")
    view.add_argument("file", type=Path, metavar="FILE", help="a cloud, SKILL.npz, contacts.json or trial.npz")
    view.add_argument("--out", type=Path, metavar="PAGE.html", help="the page (default: FILE with .html)")
    view.set_defaults(run=_view)
    return parser


def _demo(arguments: argparse.Namespace) -> int:
    from drake_aerial.demo import run_demo

    with _progress("demo") as progress:
        summary = run_demo(arguments.out, seed=arguments.seed, progress=progress)
    print(summary)
    return 0


def _learn(arguments: argparse.Namespace) -> int:
    from drake_aerial import Demonstration, learn

    skill = learn(Demonstration.read(arguments.demonstration), seed=arguments.seed)
    skill.save(arguments.out)
    _report(
        arguments.json,
        {"skill": str(arguments.out), "label": skill.label, "grippers": len(skill)},
        f"learnt {skill.label!r} ({len(skill)} gripper(s)) -> {arguments.out}",
    )
    return 0


def _demonstrate(arguments: argparse.Namespace) -> int:
    from drake_aerial.demonstrating.draft import DemonstrationDraft
    from drake_aerial.demonstrating.server import demonstrate
    from drake_aerial.named_inputs import read_scan

    cloud = read_scan(arguments.cloud, viewpoint=arguments.viewpoint, up=arguments.up)
    draft = DemonstrationDraft(cloud, cloud.path)
    if arguments.at is None:
        out = demonstrate(
            draft,
            arguments.out,
            name=arguments.name,
            cable_length=arguments.cable_length,
            port=arguments.port,
            open_browser=not arguments.no_browser,
            tell=lambda url: print(f"click the contacts at {url} (Ctrl-C: give up)", file=sys.stderr, flush=True),
        )
    else:
        demonstration = draft.demonstration(
            arguments.at, cable_length=arguments.cable_length, name=arguments.name or arguments.out.stem
        )
        out = draft.write(arguments.out, demonstration)
        for touch in map(draft.touch, demonstration.grippers.p):
            where = " ".join(f"{x:+.3f}" for x in touch.position)
            print(f"contact at {where} m touches: {touch.surface} ({touch.features} features)")
    print(f"-> {out}")
    return 0


def _transfer(arguments: argparse.Namespace) -> int:
    from drake_aerial import transfer
    from drake_aerial.named_inputs import read_scan, read_skill
    from drake_aerial.transferring.parameters import TransferParameters
    from drake_aerial.transport.lifting import default_lift

    skill = read_skill(arguments.skill)
    lift = None if arguments.mass is None else default_lift(arguments.mass, len(skill))
    parameters = TransferParameters(lift=lift)
    cloud = read_scan(arguments.cloud, viewpoint=arguments.viewpoint, up=arguments.up)
    with _progress("transfer") as progress:
        solutions = transfer(
            skill,
            cloud,
            method=arguments.method,
            top=arguments.top,
            seed=arguments.seed,
            parameters=parameters,
            progress=progress,
        )
        if arguments.refine:
            from drake_aerial import refine

            solutions = refine(skill, solutions, parameters=parameters, progress=progress)
    solutions.write(arguments.out)
    if arguments.html:
        from drake_aerial.drawing.views import write_contacts_page

        write_contacts_page(arguments.html, solutions, cloud)
    _report(arguments.json, solutions.to_dict(), f"{_lines(solutions)}\n-> {arguments.out}")
    return 0 if any(solution.feasible for solution in solutions.solutions) else 1


def _fly(arguments: argparse.Namespace) -> int:
    from drake_aerial import prepare_flight, write_diagram_picture
    from drake_aerial.drawing.replay import write_replay

    with _progress("fly") as progress:
        flight = prepare_flight(
            arguments.contacts,
            payload=arguments.payload,
            mass=arguments.mass,
            solution=arguments.solution,
            belief=arguments.belief,
            controller=arguments.controller,
            trajectory=arguments.trajectory,
            cable=arguments.cable,
            force=arguments.force,
        )
        if arguments.graphviz:
            write_diagram_picture(arguments.graphviz, flight.station)
        result = flight.run(arguments.seed, progress=progress)
    result.save(arguments.out)
    write_replay(arguments.out / "flight.html", result)
    _report(arguments.json, result.metrics, f"{result.summary()}\n-> {arguments.out}")
    return 0 if result.metrics["outcome"] == "completed" else 1


def _study(arguments: argparse.Namespace) -> int:
    from drake_aerial import StudyPlan, run_study
    from drake_aerial.study.report import write_report
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
        f"at {arguments.scheduler}" if arguments.scheduler else f"{workers} workers" if workers else "in this process"
    )
    print(f"study {plan.name!r}: {plan.count} flights at most, {where}", file=sys.stderr)
    with _progress("study") as bar:
        progress = bar if sys.stderr.isatty() else _logged("study")
        summary = run_study(plan, arguments.out, workers=workers, scheduler=arguments.scheduler, progress=progress)
        report = write_report(arguments.out, progress=progress) if summary.outcomes else None
    for complaint in (*summary.complaints, *summary.errors):
        print(f"drake-aerial study: {complaint}", file=sys.stderr)
    _report(arguments.json, summary.to_dict(), f"{summary}\n{report or 'no report: there are no records'}")
    return 1 if summary.errors else 0


def _write_study_report(arguments: argparse.Namespace) -> int:
    from drake_aerial.study.report import write_report

    with _progress("report") as progress:
        summary = write_report(arguments.folder, progress=progress)
    print(summary)
    return 0


def _view(arguments: argparse.Namespace) -> int:
    from drake_aerial.drawing.views import write_view

    out = arguments.out or arguments.file.with_suffix(".html")
    print(write_view(arguments.file, out))
    return 0


def _lines(solutions: ContactSolutions) -> str:
    """Return one line a solution: rank, likelihood, where, and whether it can be flown."""
    lines = []
    for solution in solutions.solutions:
        where = "; ".join(" ".join(f"{x:+.3f}" for x in p) for p in solution.X_SG.p)
        state = "feasible" if solution.feasible else ", ".join(solution.reasons)
        lines.append(f"{solution.rank:2d}  log J {solution.log_likelihood:8.2f}  at {where} m  {state}")
    return "\n".join(lines)


def _report(as_json: bool, document: dict[str, Any], text: str) -> None:
    print(json.dumps(document) if as_json else text)


@contextmanager
def _progress(label: str) -> Iterator[Callable[[float, str], None]]:
    """Yield a callback that takes the fraction done and what is being done; a bar on stderr where that is a terminal."""
    from tqdm import tqdm

    with tqdm(
        total=100,
        desc=label,
        leave=False,
        file=sys.stderr,
        disable=None,
        bar_format="{desc:<28.28} {percentage:3.0f}% |{bar}| {elapsed}",
    ) as bar:

        def update(fraction: float, what: str = "") -> None:
            bar.set_description_str(what or label, refresh=False)
            bar.n = 100.0 * min(max(fraction, 0.0), 1.0)
            bar.refresh()

        yield update


def _logged(label: str, every: float = 60.0) -> Callable[[float, str], None]:
    """Return a callback that writes a line on stderr now and then [s], for long jobs without a terminal."""
    told = 0.0

    def update(fraction: float, what: str = "") -> None:
        nonlocal told
        if time.monotonic() - told >= every:
            told = time.monotonic()
            print(f"{label}: {100 * fraction:.0f} %, {what}", file=sys.stderr, flush=True)

    return update


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _positive(text: str) -> int:
    value = int(text) if text.lstrip("+").isdigit() else 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} given, a whole number from 1 is accepted")
    return value


def _seed(text: str) -> int:
    if not text.isdigit():
        raise argparse.ArgumentTypeError(f"{text!r} given, a whole number from 0 is accepted")
    return int(text)


if __name__ == "__main__":
    sys.exit(main())
