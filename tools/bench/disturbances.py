#!/usr/bin/env python3
"""Motor lag with and without lead, and disturbances with and without the observer.

The MPC flies the box 68x61x28, one seed per row. Disturbances are wind, wrong masses and wrong
centres of mass. Rows "circle" are flights from the ground as in tools/bench/flight.py, with 1 cm of
noise on the measured position. Rows "hover" hover for 15 s from the hanging payload, without noise;
their error is that of the last 3 s.

    tools/run python tools/bench/disturbances.py                 everything (about 7 minutes)
    tools/run python tools/bench/disturbances.py --rows lag      motors only
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, Literal

import numpy as np

from drake_aerial.control.controller_parameters import Observer
from drake_aerial.estimation.disturbance_observer import DisturbanceObserver
from drake_aerial.estimation.wind_observer import WindObserver
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.wind import WindParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

LAGS = (0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08)
CONTACTS = {
    1: np.array([[0.0, 0.0, 0.14]]),
    2: np.array([[-0.25, 0.0, 0.14], [0.2, 0.0, 0.14]]),
    3: np.array([[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]]),
}
# A smaller triangle, which stays on the box where it is shifted.
SMALL = np.array([0.78, 0.78, 1.0]) * CONTACTS[3]
BREEZE = WindParameters(mean=(1.0, 0.0, 0.0))
GUSTY = WindParameters(
    mean=(1.0, 0.0, 0.0), gust=(0.0, 1.0, 0.0), turbulence=Dryden((0.3, 0.3, 0.2), (2.0, 2.0, 1.0))
)
BELIEF = {"belief": "below_contact"}
# What is wrong, the contacts, and how it is flown.
DISTURBANCES: list[tuple[str, np.ndarray, dict[str, Any]]] = [
    *((f"nothing, circle, n = {n}", CONTACTS[n], {}) for n in (1, 3)),
    *(
        (f"wind 1 m/s, hover, n = {n}", CONTACTS[n], {"wind": BREEZE, "hover": True})
        for n in (1, 3)
    ),
    *(
        (f"mass x {ratio}, hover, n = {n}", CONTACTS[n], {"mass_ratio": ratio, "hover": True})
        for n in (1, 3)
        for ratio in (0.9, 1.1)
    ),
    *(
        (f"CoM {100 * x:.0f} cm, circle, n = 1", CONTACTS[1] + [x, 0.0, 0.0], BELIEF)
        for x in (0.1, 0.15, 0.2)
    ),
    ("CoM 2.5 cm, circle, n = 2", CONTACTS[2] + [0.05, 0.0, 0.0], BELIEF),
    ("CoM 10 cm, circle, n = 3", SMALL + [0.0, 0.1, 0.0], BELIEF),
    ("CoM 10 cm, slack, n = 3", SMALL + [0.1, 0.0, 0.0], BELIEF),
    ("wind, gust, turbulence, n = 1", CONTACTS[1], {"wind": GUSTY}),
]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rows", nargs="+", choices=("lag", "observer"), default=["lag", "observer"]
    )
    parser.add_argument("--seed", type=int, default=100, help="(default: 100)")
    parser.add_argument(
        "--only",
        default="",
        metavar="WORDS",
        help="rows of the observer whose name holds these words",
    )
    arguments = parser.parse_args()
    if "lag" in arguments.rows:
        for lag in LAGS:
            for lead in (False, True) if lag else (False,):
                row = fly(
                    CONTACTS[1], arguments.seed, parameters={"motor_lag": lag, "motor_lead": lead}
                )
                print(
                    f"motor lag {1e3 * lag:3.0f} ms, lead {'on ' if lead else 'off'} | {row}",
                    flush=True,
                )
    if "observer" in arguments.rows:
        for name, contacts, how in DISTURBANCES:
            observers: dict[str, Observer | Literal["off"]] = {
                "off": "off",
                "force": DisturbanceObserver(),
            }
            if "wind" in how:
                observers["wind"] = WindObserver()
            for kind, observer in observers.items() if arguments.only in name else ():
                row = fly(contacts, arguments.seed, observer=observer, **how)
                print(f"{name:<30} observer {kind:<5} | {row}", flush=True)
    return 0


def fly(
    contacts: np.ndarray,
    seed: int,
    *,
    hover: bool = False,
    belief: str = "true",
    mass_ratio: float = 1.0,
    wind: WindParameters | None = None,
    observer: Observer | Literal["off"] = "off",
    parameters: dict[str, Any] | None = None,
) -> str:
    """Fly once and return what is said about it."""
    box = Payload.read("box_68x61x28")
    station = StationParameters(noise=0.0 if hover else 0.01, wind=wind, **(parameters or {}))
    flight = Flight(
        SuspendedPayload.from_contacts(box, contacts, np.tile([0.0, 0.0, 1.0], (len(contacts), 1))),
        FlightOptions(
            belief=belief,
            trajectory=HoverTrajectory(hover_time=15.0) if hover else "transport",
            parameters=station,
            controller_options={"observer": observer},
            mass_ratio=mass_ratio,
        ),
    )
    result = flight.run(seed)
    m, s = result.metrics, result.series
    if m["outcome"] != "completed":
        return f"{m['outcome']} at {m['outcome_time_s']:.1f} s: {m['outcome_reason']}"
    last = np.linalg.norm(s["payload_position"] - s["reference_position"], axis=1)[-300:]
    words = [f"RMSE {100 * m['position_rmse_m']:6.2f} cm", f"last 3 s {100 * last.mean():6.2f} cm"]
    words += [
        f"saturated {100 * m['saturated_fraction']:4.1f} %",
        f"MPC {m['timing']['mpc_step_ms']['mean']:.2f} ms",
    ]
    return ", ".join(words)


if __name__ == "__main__":
    sys.exit(main())
