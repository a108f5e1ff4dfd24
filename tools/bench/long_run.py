#!/usr/bin/env python3
"""Memory growth over many flights in one process.

One station flies short flights (from the air, 1 s of hover, 1 cm of noise), each with its own seed.
The resident memory is read after 20 flights, when all caches are filled, and at the end.

    tools/run python tools/bench/long_run.py        500 flights of one and of three quadrotors
"""

from __future__ import annotations

import argparse
import gc
import os
import sys
from pathlib import Path

import numpy as np

from drake_aerial import Payload
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.suspended_payload import SuspendedPayload

CONTACTS = {
    1: [[0.0, 0.0, 0.14]],
    3: [[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]],
}
WARM, LIMIT = 20, 100.0


def resident() -> float:
    """Return this process's resident memory [MB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flights", type=int, default=500, help=f"more than {WARM} (default: 500)")
    parser.add_argument(
        "--n",
        nargs="+",
        type=int,
        choices=list(CONTACTS),
        default=list(CONTACTS),
        help="quadrotors",
    )
    arguments = parser.parse_args()
    grown = []
    for n in arguments.n:
        suspension = SuspendedPayload.from_contacts(
            Payload.read("box_68x61x28"), CONTACTS[n], np.tile([0.0, 0.0, 1.0], (n, 1))
        )
        flight = Flight(
            suspension, FlightOptions(belief="true", trajectory=HoverTrajectory(hover_time=1.0))
        )
        marks = {}
        for k in range(1, arguments.flights + 1):
            flight.run(k)
            if k in (WARM, arguments.flights // 2, arguments.flights):
                gc.collect()
                marks[k] = resident()
        grown.append(marks[arguments.flights] - marks[WARM])
        told = ", ".join(f"{value:.0f} MB after {k}" for k, value in marks.items())
        print(
            f"{n} quadrotor(s), {arguments.flights} flights: {told}; "
            f"grown by {grown[-1]:.1f} MB (limit {LIMIT:.0f})",
            flush=True,
        )
    return int(max(grown) > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
