"""The command ``transfer``: find contacts on a new scan."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from drake_aerial.choices import METHODS
from drake_aerial.cli.arguments import (
    add_json,
    add_object,
    add_parameters,
    add_scan,
    add_seed,
    object_of,
    scan_of,
    whole_number,
)
from drake_aerial.cli.output import print_result, progress_bar, say, say_assumptions

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.contacts.solutions import ContactSolutions


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "transfer",
        help="find contacts for a skill's grippers on a new scan",
        description="Find contacts for a skill's grippers on a new scan. The exit code is 1 if no "
        "solution is feasible, or the trust in the best one is below `min_trust` (0.5, see "
        "`drake-aerial defaults transfer`).",
    )
    command.add_argument(
        "skill",
        metavar="SKILL",
        help="a skill .npz, a demonstration's YAML file, or the name of a shipped demonstration",
    )
    add_scan(command)
    add_object(command)
    command.add_argument(
        "--out", type=Path, required=True, metavar="contacts.json", help="file to write"
    )
    command.add_argument(
        "--method",
        choices=METHODS,
        default="task",
        help="task (default); paper: as published; kopicki: the paper's baseline; control: "
        "task without votes; registration: the demonstrated place, carried by a non-rigid "
        "registration of the scans (needs biocpd); obb: its place in the bounding box; centroid: "
        "above the centroid of the scan, without learning",
    )
    command.add_argument(
        "--top",
        type=whole_number(1),
        default=5,
        metavar="N",
        help="number of solutions (default: 5)",
    )
    add_parameters(command, "transfer")
    add_seed(command)
    command.add_argument(
        "--mass",
        type=float,
        metavar="KG",
        help="also check that the paper's quadrotors can lift this mass (default: no check)",
    )
    command.add_argument(
        "--refine",
        action="store_true",
        help="refine each solution with a MathematicalProgram, and keep the better one",
    )
    command.add_argument(
        "--html", type=Path, metavar="FILE", help="also write an HTML page that shows the contacts"
    )
    add_json(command, "the contacts")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Transfer the skill and write the contacts. Fail if none is feasible."""
    from drake_aerial import read_parameters, transfer
    from drake_aerial.contacts.parameters import TransferParameters
    from drake_aerial.contacts.trust.statements import low_trust
    from drake_aerial.named_inputs import read_skill
    from drake_aerial.plant.team_lift import default_lift

    skill = read_skill(arguments.skill)
    parameters = TransferParameters()
    if arguments.parameters is not None:
        parameters = read_parameters("transfer", arguments.parameters)
    if arguments.mass is not None:
        parameters = replace(parameters, lift=default_lift(arguments.mass, len(skill)))
    cloud = object_of(arguments, arguments.at)
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
    # The features add what was assumed about spacing and outside.
    found = solutions.cloud.get("assumptions", [])[len(cloud.assumptions) :]
    say_assumptions({"assumptions": found})
    solutions.write(arguments.out)
    if arguments.html:
        _write_page(arguments, solutions, cloud)
    print_result(arguments.json, solutions.to_dict(), f"{_table(solutions)}\n-> {arguments.out}")
    best = solutions.best
    if best is None:
        return 1
    if best.trust is not None and not solutions.is_trusted:
        say(low_trust(best.trust, parameters.min_trust))
    return 0 if solutions.is_trusted else 1


def _write_page(
    arguments: argparse.Namespace, solutions: ContactSolutions, cloud: PointCloud
) -> None:
    """Write a page of the contacts on their scan, or in the whole scene."""
    if cloud.scene_object is None:
        from drake_aerial.visualization.file_view import write_contacts_page

        write_contacts_page(arguments.html, solutions, cloud)
        return
    from drake_aerial.scene.find_scene import find_scene
    from drake_aerial.visualization.scene_page import write_scene_page

    write_scene_page(arguments.html, find_scene(scan_of(arguments)), solutions)


def _table(solutions: ContactSolutions) -> str:
    """Return one line per solution: rank, likelihood, positions, feasibility."""
    lines = []
    for solution in solutions.solutions:
        where = "; ".join(" ".join(f"{x:+.3f}" for x in p) for p in solution.X_SG.p)
        state = "feasible" if solution.feasible else ", ".join(map(str, solution.reasons))
        trust = "" if solution.trust is None else f"  trust {solution.trust.probability:4.2f}"
        likely = f"log J {solution.log_likelihood:8.2f}{trust}"
        lines.append(f"{solution.rank:2d}  {likely}  at {where} m  {state}")
    for extent in solutions.hidden:
        lines += extent.sentences(solutions[0].X_SG.p)
    return "\n".join(lines)
