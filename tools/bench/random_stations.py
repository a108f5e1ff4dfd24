#!/usr/bin/env python3
"""Random stations, valid and absurd: every run ends with a named outcome or a one-line error.

Random are the team (1 to 6 quadrotors, equal or not, thrust coefficients, cable lengths of both
kinds, holding forces), the payload (a box of 2 to 120 cm and 10 g to 1 kg, its centre of mass
anywhere inside), the contacts (anywhere on its top, also two in one place), the belief, the
controller and its errors, wind, noise, delays of the motors and of the loop, time steps from 0.2 to
10 ms, and whether the flight starts from the ground. Each flies for 2 s of simulated time after
take-off. A station depends on its number only.

    tools/run python tools/bench/random_stations.py          1,000 stations (about 10 CPU minutes)
    tools/run python tools/bench/random_stations.py --first 17 --count 1 --show
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from drake_aerial import InputError, JobError, Payload, StationParameters, WindParameters
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.outcome import OUTCOMES
from drake_aerial.simulation.suspended_payload import SuspendedPayload

BATCH = 25
"""Stations a process: Drake never frees a diagram that holds Python systems."""


def draw(number: int) -> dict[str, Any]:
    """Return payload, contacts and flight options of a station, by name."""
    rng = np.random.default_rng([20, number])
    n = int(rng.choice([1, 1, 1, 2, 3, 3, 4, 5, 6]))
    # Most are large enough for their quadrotors.
    size = np.exp(rng.uniform(np.log(0.02 if rng.random() < 0.4 else 0.5), np.log(1.2), 3))
    mass = float(np.exp(rng.uniform(np.log(0.01), np.log(1.0))))
    moments = (
        mass
        / 12.0
        * np.array(
            [size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2]
        )
    )
    com = size * rng.uniform(-0.5, 0.5, 3) * rng.choice([0.0, 0.3, 1.0])
    contacts = np.column_stack(
        [size[:2] * rng.uniform(-0.5, 0.5, (n, 2)), np.full(n, 0.5 * size[2])]
    )
    if n > 1 and rng.random() < 0.5:
        turn = 2.0 * np.pi * (np.arange(n) / n + rng.random())
        contacts[:, :2] = 0.45 * size[:2] * np.column_stack([np.cos(turn), np.sin(turn)])
    if n > 1 and rng.random() < 0.05:
        contacts[1] = contacts[0]
    kind = "elastic" if rng.random() < 0.35 else "inextensible"
    equal = rng.random() < 0.5

    def several(make):
        return make() if equal else [make() for _ in range(n)]

    return {
        "payload": Payload.from_box(size, mass, com=com, inertia=moments),
        "contacts": contacts,
        "belief": str(rng.choice(["below_contact", "true", "geometric"])),
        "controller": str(rng.choice(["mpc", "mpc", "geometric_ff", "geometric"])),
        "mass_ratio": float(rng.choice([1.0, 1.0, rng.uniform(0.5, 2.0)])),
        "force": bool(rng.random() < 0.5),
        "trajectory": HoverTrajectory(hover_time=2.0)
        if rng.random() < 0.5
        else HoverTrajectory(ground_time=1.0, lift_time=1.5, lift_height=0.5, hover_time=2.0),
        "parameters": StationParameters(
            quadrotor=several(
                lambda: QuadrotorParameters(
                    mass=float(rng.uniform(0.1, 0.45)),
                    thrust_coefficient=float(6.572e-9 * np.exp(rng.uniform(-0.3, 1.2))),
                    arm=float(rng.uniform(0.05, 0.3)),
                )
            ),
            cable=several(
                lambda: CableParameters(
                    kind=kind,
                    length=float(np.exp(rng.uniform(np.log(0.05), np.log(3.0)))),
                    stiffness=float(10 ** rng.uniform(2, 3.5)),
                    damping=float(rng.uniform(0, 10)),
                )
            ),
            gripper=several(
                lambda: GripperParameters(holding_force=float(rng.choice([2.0, 20.0, np.inf])))
            ),
            time_step=float(rng.choice([2e-4, 1e-3, 2e-3, 2e-3, 4e-3, 1e-2])),
            noise=float(rng.choice([0.0, 0.01, 0.1])),
            measured_directions=bool(rng.random() < 0.7),
            attitude_period=float(rng.choice([0.0, 0.0, 0.01, 0.02])),
            initial_slack=float(rng.choice([0.0, 0.04])),
            motor_lag=float(rng.choice([0.0, 0.0, 0.02, 0.05])),
            wind=None
            if rng.random() < 0.5
            else WindParameters(
                mean=tuple(rng.normal(0.0, 4.0, 3).tolist()),
                gust=tuple(rng.normal(0.0, 4.0, 3).tolist()),
                gust_start=0.5,
                turbulence=Dryden((0.5, 0.5, 0.3), (2.0, 2.0, 1.0)) if rng.random() < 0.5 else None,
            ),
        ),
    }


def run(number: int) -> dict[str, Any]:
    """Fly one station; return its number, how it ended and why, and its CPU time [s]."""
    began = time.process_time()
    try:
        options = draw(number)
        payload, contacts = options.pop("payload"), options.pop("contacts")
        suspension = SuspendedPayload.from_contacts(
            payload, contacts, np.tile([0.0, 0.0, 1.0], (len(contacts), 1))
        )
        metrics = Flight(suspension, FlightOptions(**options)).run(number).metrics
        ended, why = metrics["outcome"], metrics["outcome_reason"]
        json.dumps(metrics, allow_nan=False)
    except (InputError, JobError) as refusal:
        ended, why = "refused", " ".join(str(refusal).split())
    except Exception as error:  # which is what this looks for
        ended, why = "error", f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
    return {"number": number, "ended": ended, "why": why, "cpu_s": time.process_time() - began}


def batch(first: int, count: int) -> list[dict[str, Any]]:
    """Run stations in a process of their own; those that it did not report are its victims."""
    command = [sys.executable, __file__, "--first", str(first), "--count", str(count), "--lines"]
    child = subprocess.run(command, capture_output=True, text=True, check=False)
    results = [json.loads(line) for line in child.stdout.splitlines() if line.startswith("{")]
    done = {result["number"] for result in results}
    lost = [number for number in range(first, first + count) if number not in done]
    if lost:
        why = f"exit code {child.returncode}: {' '.join(child.stderr.split())[-300:]}"
        results.append({"number": lost[0], "ended": "process died", "why": why, "cpu_s": 0.0})
        if lost[1:]:
            results += batch(lost[1], len(lost) - 1)
    return results


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first station (default: 0)"
    )
    parser.add_argument("--count", type=int, default=1000, help="how many (default: 1000)")
    parser.add_argument("--workers", type=int, default=1, help="processes at a time (default: 1)")
    parser.add_argument(
        "--show", action="store_true", help="run them here and print each one's end"
    )
    parser.add_argument("--lines", action="store_true", help="the same, one line of JSON each")
    arguments = parser.parse_args()
    numbers = range(arguments.first, arguments.first + arguments.count)
    if arguments.show or arguments.lines:
        for number in numbers:
            result = run(number)
            print(
                json.dumps(result)
                if arguments.lines
                else f"{number}: {result['ended']} {result['why']}",
                flush=True,
            )
        return 0
    with ThreadPoolExecutor(arguments.workers) as pool:
        parts = [
            (first, min(BATCH, numbers.stop - first))
            for first in range(numbers.start, numbers.stop, BATCH)
        ]
        results = [result for part in pool.map(lambda part: batch(*part), parts) for result in part]
    counts = Counter(result["ended"] for result in results)
    print(
        f"{len(results)} random stations, "
        f"{sum(result['cpu_s'] for result in results) / 60:.1f} CPU minutes"
    )
    for ended in (*OUTCOMES, "refused", "error", "process died"):
        print(f"  {ended:<14}{counts[ended]:>6}")
    bad = [result for result in results if result["ended"] in ("error", "process died")]
    for result in bad:
        print(f"  station {result['number']}: {result['why']}")
    print("every run ended with an outcome or a refusal" if not bad else f"{len(bad)} did not")
    return 1 if bad or len(results) != arguments.count else 0


if __name__ == "__main__":
    sys.exit(main())
