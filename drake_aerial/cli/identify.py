"""The command ``identify``: mass, centre of mass and inertia of a payload from a flight."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_aerial.cli.arguments import add_json
from drake_aerial.cli.output import print_result

if TYPE_CHECKING:
    from drake_aerial.estimation.mass_identification import Identification
    from drake_aerial.simulation.trial_result import TrialResult


def add_command(commands: argparse._SubParsersAction) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "identify",
        help="identify mass, centre of mass and inertia of a payload from a recorded flight",
        description="Identify mass, centre of mass and inertia of a payload from a recorded "
        "flight, each with its standard deviation. The output names the directions in which the "
        "flight does not determine the centre of mass.",
    )
    command.add_argument(
        "folder", type=Path, metavar="DIR", help="a flight's folder, or its trial.npz"
    )
    command.add_argument(
        "--forces",
        choices=("thrust", "tension"),
        default="thrust",
        help="forces of the cables: from thrust and motion of the quadrotors (default), or the "
        "recorded tensions",
    )
    add_json(command, "the result")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Identify the payload and print the result."""
    from drake_aerial.estimation.mass_identification import identify_payload
    from drake_aerial.simulation.recorded_motion import gripper_masses, recorded_motion
    from drake_aerial.simulation.trial_result import TrialResult

    trial = TrialResult.load(arguments.folder)
    motion = recorded_motion(trial, arguments.forces)
    result = identify_payload(motion, trial.vertices, gripper_mass=gripper_masses(trial))
    document = {**result.to_dict(), "forces": arguments.forces}
    print_result(arguments.json, document, _text(result, trial))
    return 0


def _text(result: "Identification", trial: "TrialResult") -> str:
    """Return the result as lines: value, standard deviation, and the simulated truth."""
    body = result.parameters
    truth: dict[str, Any] = trial.metrics["configuration"].get("payload", {})
    lines = [
        f"{'':24s}{'estimate':>12s}{'std':>12s}{'simulated':>12s}",
        _row("mass [kg]", body.mass, result.mass_std, truth.get("mass")),
    ]
    com = truth.get("com_L", [None] * 3)
    for k, axis in enumerate("xyz"):
        std = float(result.com_covariance[k, k]) ** 0.5
        lines.append(_row(f"centre of mass {axis} [m]", body.com[k], std, com[k]))
    inertia = truth.get("inertia", [[None] * 3] * 3)
    for k, axis in enumerate("xyz"):
        std = float(result.inertia_std[k])
        name = f"inertia {axis}{axis} [kg m^2]"
        lines.append(_row(name, body.inertia[k, k], std, inertia[k][k]))
    for direction in result.unobservable:
        where = ", ".join(f"{x:+.2f}" for x in direction)
        lines.append(
            f"not observable: the centre of mass along ({where}) in L; the value is the prior of "
            "the payload's shape. Fly the payload at another attitude, or let it swing"
        )
    if result.constrained:
        lines.append(
            "the least-squares fit was not physically possible; these are the nearest possible "
            "values"
        )
    return "\n".join(lines)


def _row(name: str, value: float, std: float, truth: float | None) -> str:
    known = "" if truth is None else f"{truth:12.5g}"
    return f"{name:24s}{value:12.5g}{std:12.2g}{known}"
