#!/usr/bin/env python3
"""Time of a study of 400 flights, and the gain by a second worker.

The study: conditions A to D of the paper, `task` and `paper`, five solutions of ten trials each,
belief `below_contact`. It runs as a user runs it, with transfers and start of the workers. Then a
part of it, with saved contacts, runs with one worker and with two in turn; the rate is that from
the end of the first flight to the end of the last. Two hardware threads of one core are not two
cores: the gain by two unrelated processes that fly at the same time is printed, too, as the upper
limit.

    tools/run python tools/bench/study_speed.py                  everything (about 20 minutes)
    tools/run python tools/bench/study_speed.py --trials 0       the second worker only
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from drake_aerial import StudyPlan, run_study
from drake_aerial.study.plan import Flights

WANTED_MINUTES, WANTED_GAIN = 12.0, 1.8
ALONE = """
import time
from drake_aerial import Payload
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.suspended_payload import SuspendedPayload
box = Payload.read("box_68x61x28")
flight = Flight(SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]]))
flight.run(0)
began = time.perf_counter()
for seed in range(1, 6):
    flight.run(seed)
print((time.perf_counter() - began) / 5)
"""


def plan(trials: int, conditions: str = "ABCD") -> StudyPlan:
    """Return the plan, of the shipped study's conditions."""
    whole = StudyPlan.read("paper").chosen(conditions=list(conditions), beliefs=["below_contact"])
    flown = Flights(tuple(conditions), ("task", "paper"), ("below_contact",), ("table",), 5, trials)
    return replace(whole, flights=(flown,))


def rate(trials: int, workers: int, contacts: Path) -> float:
    """Return flights per second from the first flight's end to the last one's."""
    ends: list[float] = []

    def note(_: float, what: str) -> None:
        if what.startswith("flight "):
            ends.append(time.perf_counter())

    with tempfile.TemporaryDirectory() as folder:
        for name in ("contacts", "scans", "skills"):
            shutil.copytree(contacts / name, Path(folder) / name)
        run_study(plan(trials, "AC"), folder, workers=workers, progress=note)
    # The first message precedes all flights; each worker's first flight includes its set-up.
    ends = ends[1 + workers :]
    return (len(ends) - 1) / (ends[-1] - ends[0])


def alone(processes: int) -> float:
    """Return the seconds of a flight while so many fly, each in a process of its own."""
    flying = [
        subprocess.Popen([sys.executable, "-c", ALONE], stdout=subprocess.PIPE, text=True)
        for _ in range(processes)
    ]
    return float(np.mean([float(process.communicate()[0]) for process in flying]))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--trials",
        type=int,
        default=10,
        help="of each solution in the whole study; 0 leaves it out (default: 10)",
    )
    parser.add_argument(
        "--part",
        type=int,
        default=2,
        help="trials of each solution with one and two workers (default: 2)",
    )
    parser.add_argument("--rounds", type=int, default=2, help="(default: 2)")
    arguments = parser.parse_args()
    if arguments.trials:
        with tempfile.TemporaryDirectory() as folder:
            summary = run_study(plan(arguments.trials), folder, workers=2)
        print(
            f"{summary.flown} flights, 2 workers: {summary.wall_s / 60:.1f} min wall "
            f"(wanted {WANTED_MINUTES:g} for 400), "
            f"{summary.cpu_s / 60:.1f} min CPU of flights",
            flush=True,
        )
    with tempfile.TemporaryDirectory() as folder:
        run_study(plan(1, "AC"), folder)
        print(
            f"{'':<8}{'1 worker, flights/s':>21}{'2 workers':>11}{'gain':>7}{'strangers gain':>16}"
        )
        gains = []
        for turn in range(1, arguments.rounds + 1):
            one, two = (rate(arguments.part, workers, Path(folder)) for workers in (1, 2))
            strangers = 2.0 * alone(1) / alone(2)
            gains.append(two / one)
            print(
                f"round {turn:<2}{one:>21.3f}{two:>11.3f}{two / one:>7.2f}{strangers:>16.2f}",
                flush=True,
            )
    print(f"a second worker brings {np.median(gains):.2f} times (wanted {WANTED_GAIN:g})")
    return 0


if __name__ == "__main__":
    sys.exit(main())
