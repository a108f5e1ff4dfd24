"""The verb ``transfer``: where the grippers of a skill go on a new scan."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.cli.answer import answer, tell_assumptions
from drake_aerial.cli.arguments import (
    add_json,
    add_parameters,
    add_scan,
    add_seed,
    positive_number,
    scan_of,
)
from drake_aerial.cli.progress import progress_bar

if TYPE_CHECKING:
    from drake_aerial.contacts.solutions import ContactSolutions

# Named here again, since a parser that asked the library for them would load it to print its help.
METHODS = ("task", "paper", "kopicki", "centroid")


def add_verb(verbs: argparse._SubParsersAction) -> None:
    """Add the verb and its arguments."""
    verb = verbs.add_parser("transfer", help="find where the grippers go on a new scan")
    verb.add_argument(
        "skill", metavar="SKILL", help="a skill .npz, or the name of a shipped demonstration"
    )
    add_scan(verb)
    verb.add_argument("--out", type=Path, required=True, metavar="contacts.json")
    verb.add_argument("--method", choices=METHODS, default="task")
    verb.add_argument(
        "--top",
        type=positive_number,
        default=5,
        metavar="N",
        help="how many solutions (default: 5)",
    )
    add_parameters(verb, "transfer")
    add_seed(verb)
    verb.add_argument(
        "--mass",
        type=float,
        metavar="KG",
        help="also judge whether the paper's quadrotors lift a payload of this mass (default: its mass is not judged)",
    )
    verb.add_argument(
        "--refine",
        action="store_true",
        help="improve each solution by a MathematicalProgram; never makes one worse",
    )
    verb.add_argument(
        "--html", type=Path, metavar="FILE", help="also write a page that shows the contacts"
    )
    add_json(verb, "the contacts")
    verb.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Transfer the skill, write the contacts; fail where none is feasible."""
    from drake_aerial import read_parameters, transfer
    from drake_aerial.contacts.parameters import TransferParameters
    from drake_aerial.named_inputs import read_skill
    from drake_aerial.simulation.lift_check import default_lift

    skill = read_skill(arguments.skill)
    parameters = TransferParameters()
    if arguments.parameters is not None:
        parameters = read_parameters("transfer", arguments.parameters)
    if arguments.mass is not None:
        parameters = replace(parameters, lift=default_lift(arguments.mass, len(skill)))
    cloud = scan_of(arguments)
    with progress_bar("transfer") as progress:
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
    # Surface features add what was assumed about spacing and outside.
    found = solutions.cloud.get("assumptions", [])[len(cloud.assumptions) :]
    tell_assumptions(f"{assumption['kind']}: {assumption['text']}" for assumption in found)
    solutions.write(arguments.out)
    if arguments.html:
        from drake_aerial.visualization.views import write_contacts_page

        write_contacts_page(arguments.html, solutions, cloud)
    answer(arguments.json, solutions.to_dict(), f"{_table(solutions)}\n-> {arguments.out}")
    return 0 if any(solution.feasible for solution in solutions.solutions) else 1


def _table(solutions: ContactSolutions) -> str:
    """Return one line a solution: rank, likelihood, where, and whether it can be flown."""
    lines = []
    for solution in solutions.solutions:
        where = "; ".join(" ".join(f"{x:+.3f}" for x in p) for p in solution.X_SG.p)
        state = "feasible" if solution.feasible else ", ".join(solution.reasons)
        lines.append(
            f"{solution.rank:2d}  log J {solution.log_likelihood:8.2f}  at {where} m  {state}"
        )
    return "\n".join(lines)
