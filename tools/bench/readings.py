"""Effect of our readings of the paper's ambiguous points, one at a time.

    tools/run python tools/bench/readings.py

Contacts are learnt on the flat demonstration. Errors are in cm from the top's centre, seen from
above: median [min max] over seeds of the median over the best five solutions. Flights carry the box
68x61x28 by its centre; errors are RMSE in cm of the tracked point over circle and hover. Prints the
tables of docs/readings.md.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from drake_aerial import Demonstration, Payload, StationParameters, learn, read_scan, transfer
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.errors import DrakeAerialError
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.references.trajectory import TransportTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.skill.parameters import LearningParameters

FIRST_SEED = 100


def contacts(
    label: str, seeds: int, *, method: str = "task", learning=None, transferring=None
) -> None:
    """Print one row of contact errors on two boxes."""
    shown = Demonstration.read("flat")
    cells = []
    for name in ("box_68x68x28", "box_68x61x28"):
        scan, errors, off_top = read_scan(name), [], 0
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            skill = learn(shown, parameters=learning or LearningParameters(), seed=seed)
            try:
                found = transfer(
                    skill,
                    scan,
                    method=method,
                    seed=seed,
                    parameters=transferring or TransferParameters(),
                )
            except DrakeAerialError:
                continue
            p = np.array([s.X_SG.p[0] for s in found.solutions])
            off_top += int((p[:, 2] < 0.13).sum())
            errors.append(100.0 * float(np.median(np.linalg.norm(p[:, :2], axis=1))))
        cells.append(
            f"{name} {np.median(errors):5.1f} [{min(errors):4.1f} {max(errors):4.1f}] "
            f"off the top {off_top}/{5 * seeds}"
        )
    print(f"{label:34s} " + "   ".join(cells), flush=True)


def flight(label: str, seeds: int, **options) -> None:
    """Print one row of flight errors."""
    payload = Payload.read("box_68x61x28")
    suspension = SuspendedPayload.from_contacts(payload, [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]])
    try:
        ready = Flight(
            suspension, FlightOptions(**{"belief": "true", "path_limits": None, **options})
        )
    except DrakeAerialError as error:
        print(f"{label:34s} refused: {error}", flush=True)
        return
    runs = [ready.run(seed) for seed in range(FIRST_SEED, FIRST_SEED + seeds)]
    rmse = [
        100.0 * run.metrics["position_rmse_m"]
        for run in runs
        if run.metrics["position_rmse_m"] is not None
    ]
    peak = max(
        100.0 * run.metrics["position_max_m"]
        for run in runs
        if run.metrics["position_max_m"] is not None
    )
    outcomes = ", ".join(sorted({run.outcome for run in runs}))
    print(
        f"{label:34s} {np.mean(rmse):6.2f} [{min(rmse):5.2f} {max(rmse):5.2f}] "
        f"peak {peak:6.2f}  {outcomes}",
        flush=True,
    )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--flights", type=int, default=3)
    parser.add_argument(
        "--rows", nargs="+", choices=("contacts", "flights"), default=["contacts", "flights"]
    )
    arguments = parser.parse_args()
    if "contacts" in arguments.rows:
        print_contacts(arguments.seeds)
    if "flights" in arguments.rows:
        print_flights(arguments.flights)


def print_contacts(n: int) -> None:
    """Print the table of contacts, n seeds each."""
    print(f"contacts, seeds {FIRST_SEED}..{FIRST_SEED + n - 1}, cm")
    contacts("task", n)
    contacts("task, full rotations compared", n, learning=LearningParameters(axial=False))
    contacts("task, rigid votes", n, transferring=TransferParameters(scale="rigid"))
    contacts("paper", n, method="paper")
    contacts(
        "paper, full rotations compared",
        n,
        method="paper",
        learning=LearningParameters(axial=False),
    )
    contacts(
        "paper, votes scaled", n, method="paper", transferring=TransferParameters(paper_scale=True)
    )


def print_flights(n: int) -> None:
    """Print the table of flights, n seeds each."""
    print(f"flights, seeds {FIRST_SEED}..{FIRST_SEED + n - 1}, cm")
    base = StationParameters()
    constant = TransportTrajectory(timing="constant")
    flight("mpc, quintic timing", n)
    flight("mpc, constant rate", n, trajectory=constant)
    flight("geometric, quintic timing", n, controller="geometric")
    flight("geometric, constant rate", n, controller="geometric", trajectory=constant)
    flight("mpc, elastic cable", n, cable="elastic")
    flight("mpc, directions from position", n, parameters=replace(base, measured_directions=False))
    flight(
        "mpc, 3.94e-9 N/rpm^2",
        n,
        parameters=replace(base, quadrotor=QuadrotorParameters(thrust_coefficient=3.94e-9)),
    )


if __name__ == "__main__":
    main()
