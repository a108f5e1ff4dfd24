#!/usr/bin/env python3
"""Flight tables: tracking, beliefs and timings of one quadrotor, then of formations.

One quadrotor carries the box 68x61x28. Each row flies from the ground: lift, approach, two turns
of a 1 m circle in 12 s, 5 s of hover, with 1 cm of noise on the measured payload position. Only
the noise differs between seeds. The RMSE of the tracked point L is over circle and hover, and
over the circle alone. It counts completed flights; all outcomes are listed beside it.

    tools/run python tools/bench/flight.py                      all, 10 seeds (about 40 minutes)
    tools/run python tools/bench/flight.py --rows centred off_centre   rows with limits
    tools/run python tools/bench/flight.py --rows formations    rows of formation_flights.py
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import formation_flights
import numpy as np

from drake_aerial.choices import BELIEFS, CONTROLLERS
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

OFFSETS = (0.0, 0.02, 0.05, 0.10, 0.15, 0.20)
# Rows: group, controller, belief, offset of the contact along the box's long side [m].
ROWS = (
    [("centred", name, "true", 0.0) for name in CONTROLLERS]
    + [("off_centre", "mpc", "true", offset) for offset in (0.1, 0.2)]
    + [("beliefs", "mpc", belief, offset) for belief in BELIEFS for offset in OFFSETS]
)
# Upper limits on the mean over the seeds [cm]: circle and hover, circle alone.
LIMITS = {
    ("mpc", "true", 0.0): (0.8, 0.95),
    ("mpc", "true", 0.1): (0.9, None),
    ("mpc", "true", 0.2): (0.9, None),
}


def main() -> int:
    arguments = parse()
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    rows = [
        row
        for row in ROWS
        if row[0] in arguments.rows
        and row[1] in arguments.controllers
        and row[2] in arguments.beliefs
    ]
    print(
        f"seeds {seeds.start}..{seeds.stop - 1}, noise {100 * arguments.noise:g} cm, "
        f"cable {arguments.cable}\n"
    )
    failed = fly_one(rows, seeds, arguments) if rows else False
    groups = [
        g for g in formation_flights.GROUPS if g in arguments.rows or "formations" in arguments.rows
    ]
    failed |= fly_several(groups, seeds) if groups else False
    return int(failed and arguments.check)


def fly_several(groups: list[str], seeds: range) -> bool:
    """Fly rows of formations, print rows and targets; return whether a target is missed."""
    print(formation_flights.HEADER)
    flown = {}
    for row, figures in formation_flights.fly_formations(groups, seeds):
        flown[row.label] = figures
        print(formation_flights.show(row, figures), flush=True)
    verdicts = list(formation_flights.judge(flown))
    print("", *(line for line, _ in verdicts), sep="\n")
    return not all(good for _, good in verdicts)


def fly_one(
    rows: list[tuple[str, str, str, float]], seeds: range, arguments: argparse.Namespace
) -> bool:
    """Fly rows of one quadrotor and print them; return whether a limit is missed."""
    known: dict[tuple[str, str, float], dict[str, Any]] = {}
    print(
        f"{'group':<11}{'controller':<14}{'belief':<15}{'offset':>7} | "
        f"{'RMSE cm: mean':>13} {'min':>6} {'max':>6} | {'circle':>6} {'max':>6} | "
        f"{'tilt deg: mean':>14} {'max':>6} | {'outcomes':<26} | "
        f"{'ms/step':>7} {'p99':>6} {'s/CPU s':>7}"
    )
    failed = False
    for group, controller, belief, offset in rows:
        key = (controller, belief, offset)
        if key not in known:
            known[key] = fly_row(controller, belief, offset, seeds, arguments)
        row = known[key]
        verdict = judge(key, row) if group != "beliefs" else ""
        failed |= "OVER" in verdict
        print(
            f"{group:<11}{controller:<14}{belief:<15}{100 * offset:>4.0f} cm | "
            f"{show(row)} {verdict}",
            flush=True,
        )
    timed = [row for (controller, _, _), row in known.items() if controller == "mpc"]
    if timed:
        step = np.mean([row["step_ms"] for row in timed])
        speed = np.mean([row["speed"] for row in timed])
        print(
            f"\nMPC step {step:.2f} ms mean (limit 4); {speed:.2f} simulated s per CPU s (limit 4)"
        )
        failed |= step > 4.0 or speed < 4.0
    if arguments.json:
        arguments.json.write_text(
            json.dumps([{"row": key, **row} for key, row in known.items()], indent=1) + "\n"
        )
    return failed


def fly_row(
    controller: str, belief: str, offset: float, seeds: range, arguments: argparse.Namespace
) -> dict[str, Any]:
    """Fly one row's seeds and return their metrics."""
    parameters = StationParameters(noise=arguments.noise)
    parameters = replace(parameters, cable=replace(parameters.cable, kind=arguments.cable))
    box = Payload.read("box_68x61x28")
    flight = Flight(
        SuspendedPayload.from_contacts(box, [[offset, 0.0, 0.14]], [[0.0, 0.0, 1.0]]),
        FlightOptions(belief=belief, controller=controller, parameters=parameters),
    )
    began = time.process_time()
    trials = [flight.run(seed).metrics for seed in seeds]
    cpu = time.process_time() - began
    done = [m for m in trials if m["outcome"] == "completed"]
    steps = [
        m["timing"]["mpc_step_ms"] for m in trials if m["timing"]["mpc_step_ms"]["mean"] is not None
    ]
    return {
        "rmse_cm": [100 * m["position_rmse_m"] for m in done],
        "circle_cm": [100 * m["circle_position_rmse_m"] for m in done],
        "tilt_mean_deg": [float(np.rad2deg(m["tilt_mean_rad"])) for m in done],
        "tilt_max_deg": [float(np.rad2deg(m["tilt_max_rad"])) for m in done],
        "outcomes": Counter(m["outcome"] for m in trials),
        "reasons": sorted({m["outcome_reason"] for m in trials if m["outcome_reason"]}),
        "step_ms": float(np.mean([s["mean"] for s in steps])) if steps else float("nan"),
        "step_p99_ms": float(np.mean([s["p99"] for s in steps])) if steps else float("nan"),
        "speed": float(np.mean([m["timing"]["real_time_factor"] for m in trials])),
        "cpu_s": cpu,
    }


def show(row: dict[str, Any]) -> str:
    """Return a row's numbers as a line of the table."""
    outcomes = ", ".join(f"{count} {name}" for name, count in sorted(row["outcomes"].items()))
    end = f"{outcomes:<26} | {row['step_ms']:7.2f} {row['step_p99_ms']:6.2f} {row['speed']:7.2f}"
    if not row["rmse_cm"]:
        blank = f"{'-':>13} {'-':>6} {'-':>6} | {'-':>6} {'-':>6} | {'-':>14} {'-':>6}"
        return f"{blank} | {end}  ({'; '.join(row['reasons'])})"
    rmse, circle = np.array(row["rmse_cm"]), np.array(row["circle_cm"])
    return (
        f"{rmse.mean():13.2f} {rmse.min():6.2f} {rmse.max():6.2f} | "
        f"{circle.mean():6.2f} {circle.max():6.2f} | "
        f"{np.mean(row['tilt_mean_deg']):14.1f} {np.max(row['tilt_max_deg']):6.1f} | {end}"
    )


def judge(key: tuple[str, str, float], row: dict[str, Any]) -> str:
    """Return whether a row stays below its limits, if it has any."""
    if key not in LIMITS:
        return ""
    if set(row["outcomes"]) != {"completed"}:
        return "OVER (not all completed)"
    both, circle = LIMITS[key]
    good = np.mean(row["rmse_cm"]) <= both and (
        circle is None or np.mean(row["circle_cm"]) <= circle
    )
    limits = f"<= {both}" + (f", circle <= {circle}" if circle else "")
    return f"{'ok' if good else 'OVER'} ({limits})"


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    groups = [*dict.fromkeys(row[0] for row in ROWS), "formations"]
    parser.add_argument(
        "--rows", nargs="+", choices=[*groups, *formation_flights.GROUPS], default=groups
    )
    parser.add_argument(
        "--controllers", nargs="+", choices=list(CONTROLLERS), default=list(CONTROLLERS)
    )
    parser.add_argument("--beliefs", nargs="+", choices=BELIEFS, default=list(BELIEFS))
    parser.add_argument("--seeds", type=int, default=10, help="how many (default: 10)")
    parser.add_argument("--first-seed", type=int, default=100, help="(default: 100)")
    parser.add_argument(
        "--noise", type=float, default=0.01, help="of the measured position [m] (default: 0.01)"
    )
    parser.add_argument("--cable", choices=("inextensible", "elastic"), default="inextensible")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write every number there")
    parser.add_argument("--check", action="store_true", help="exit 1 if a limit is not kept")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
