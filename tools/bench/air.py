#!/usr/bin/env python3
"""Tracking in air, still and moving, with mass and centre of mass known, and the cost of air.

Each row is a path of the payload: a circle and a figure eight at constant speed between smooth
ramps, and straight lines. A line takes 1 / 0.9 of the least time that the flat reference with drag
allows: thrusts within the limits, tensions above zero. The error is the RMSE of the payload's
position over the path, ramps included, without take-off and hover.

`--cost` prints the times of the MPC's step and of a whole flight, in air and without, in turns.

    tools/run python tools/bench/air.py --seeds 10
    tools/run python tools/bench/air.py --rows wind --n 1 --seeds 2
    tools/run python tools/bench/air.py --cost
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from drake_aerial.control.controller_parameters import MpcParameters
from drake_aerial.dynamics.flatness import ReferenceTable
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.estimation.sensor_parameters import SensorParameters
from drake_aerial.plant.air import AirParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.wind import WindParameters
from drake_aerial.references.path import Line, rest
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.beliefs import believed_model
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload

LARGE, SMALL = (0.68, 0.61, 0.28), (0.4, 0.4, 0.2)
RADIUS = {LARGE: 0.3, SMALL: 0.17}
"""Distance of three contacts from the box's centre [m]."""
GUSTS = WindParameters(
    mean=(5.0, 0.0, 0.0), gust=(1.0, 0.0, 0.0), gust_start=8.0, gust_duration=3.0
)
SHARE = 0.9
"""Share of the speed that flatness permits."""
RAMP = 3.0
"""Time in which a curve reaches its speed [s]."""


@dataclass(frozen=True)
class Curve:
    """A closed curve, sum of exp(i k theta) in x and y, at constant speed between two ramps."""

    waves: tuple[tuple[complex, complex, int], ...]
    """Amplitude in x and y [m] and wave number k of each wave; their real parts count."""
    turn_time: float
    turns: float
    phase: str = "path"

    @property
    def duration(self) -> float:
        """Time of the segment [s]."""
        return RAMP + self.turn_time * self.turns

    def derivatives(self, t: np.ndarray) -> np.ndarray:
        """Return the derivative stack (5, B, 3) [m, s], the curve beginning at the origin."""
        rate, end = 2.0 * np.pi / self.turn_time, self.duration
        ramp = np.polynomial.Polynomial([0, 0, 0, 0, 2.5, -3.0, 1.0])
        angle = np.zeros((5, len(t)))
        up, down = t < RAMP, t > end - RAMP
        for k in range(5):
            law = ramp.deriv(k) if k else ramp
            rising = rate * RAMP ** (1 - k) * law(t / RAMP)
            falling = -((-1.0) ** k) * rate * RAMP ** (1 - k) * law((end - t) / RAMP)
            steady = rate * (t - 0.5 * RAMP) if k == 0 else np.full(len(t), rate * (k == 1))
            whole = 2.0 * np.pi * self.turns if k == 0 else 0.0
            angle[k] = np.where(up, rising, np.where(down, whole + falling, steady))
        stack = np.zeros((5, len(t), 3))
        for x, y, k in self.waves:
            th, d1, d2, d3, d4 = k * angle
            z = np.exp(1j * th)
            stack[0, :, 0] += (x * (z - 1.0)).real
            stack[0, :, 1] += (y * (z - 1.0)).real
            for order, factor in enumerate(
                (
                    1j * d1,
                    1j * d2 - d1**2,
                    1j * (d3 - d1**3) - 3 * d1 * d2,
                    1j * (d4 - 6 * d1**2 * d2) - 3 * d2**2 - 4 * d1 * d3 + d1**4,
                ),
                1,
            ):
                stack[order, :, 0] += (x * factor * z).real
                stack[order, :, 1] += (y * factor * z).real
        return stack

    @property
    def end(self) -> np.ndarray:
        """Last point (3,) [m]."""
        return self.derivatives(np.array([self.duration]))[0, 0]


@dataclass(frozen=True)
class CurveTrajectory(Trajectory):
    """A hover, a curve, and a hover, in the air."""

    curve: Curve = Curve(((1.0, -1.0j, 1),), 6.0, 2.0)
    name: str = "curve"

    def segment_chain(self) -> list[Any]:
        """Return the segments."""
        moved = _Moved(self.curve, self.start)
        return [rest("hover", 4.0, self.start), moved, rest("hover_end", 1.0, tuple(moved.end))]


@dataclass(frozen=True)
class _Moved:
    curve: Curve
    start: tuple[float, float, float]
    phase: str = "path"

    @property
    def duration(self) -> float:
        return self.curve.duration

    def derivatives(self, t: np.ndarray) -> np.ndarray:
        stack = self.curve.derivatives(t)
        stack[0] += np.array(self.start)
        return stack

    @property
    def end(self) -> np.ndarray:
        return self.curve.end + np.array(self.start)


def circle(turn_time: float, turns: float = 3.0) -> CurveTrajectory:
    """Return a circle of radius 1 m."""
    return CurveTrajectory(curve=Curve(((1.0, -1.0j, 1),), turn_time, turns))


def eight(turn_time: float, turns: float = 3.0) -> CurveTrajectory:
    """Return a figure eight, 2 m by 1 m."""
    return CurveTrajectory(curve=Curve(((-1.0j, 0.0, 1), (0.0, -0.5j, 2)), turn_time, turns))


@dataclass(frozen=True)
class HoverAndLine(Trajectory):
    """A hover, a straight line, and a hover, in the air."""

    length: float = 6.0
    line_time: float = 4.0
    name: str = "line"

    def segment_chain(self) -> list[Any]:
        """Return the segments."""
        x, y, z = self.start
        goal = (x + self.length, y, z)
        path = Line("path", self.line_time, self.start, goal, "smooth")
        return [rest("hover", 4.0, self.start), path, rest("hover_end", 2.0, goal)]


def line(length: float, model: PayloadModelParameters) -> HoverAndLine:
    """Return a line at `SHARE` of the speed that flatness permits, by bisection of its time."""
    low, high = 0.3 * length**0.5, 6.0 * length**0.5
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        if possible(model, HoverAndLine(length=length, line_time=middle)):
            high = middle
        else:
            low = middle
    return HoverAndLine(length=length, line_time=high / SHARE)


def possible(model: PayloadModelParameters, trajectory: Trajectory) -> bool:
    """Return whether thrusts are within their limits and cables pull, along the flat reference."""
    table = ReferenceTable(model, trajectory)
    reference = table.at(np.arange(-0.5, trajectory.duration + 0.5, 0.02))
    size = np.linalg.norm(reference.F, axis=-1)
    tension = np.linalg.norm(reference.mu, axis=-1)
    upright = (reference.F[..., 2] > 0.5 * size).all()
    within = (size < model.max_thrust).all() and (size > model.min_thrust).all()
    return bool(within and upright and (tension > 0.05).all())


ROWS: dict[str, tuple[tuple[float, float, float], Any, WindParameters | None, float]] = {
    "circle 1 m, 3 s a turn": (SMALL, circle(3.0), None, 1.0),
    "circle 1 m, 3 s a turn, large box": (LARGE, circle(3.0), None, 1.0),
    "figure eight, 4 s": (SMALL, eight(4.0), None, 1.5),
    "line 6 m at 90 %": (SMALL, 6.0, None, 3.0),
    "line 20 m at 90 %": (SMALL, 20.0, None, 3.0),
    "wind 5 to 6 m/s, circle 6 s a turn": (SMALL, circle(6.0, 2.0), GUSTS, 3.0),
}
"""Box [m], path (or the length of a line [m]), wind, and the RMSE that is wanted [cm]."""


@cache
def prepare(row: str, n: int, realistic: bool) -> Flight:
    """Return the flight of a row, with realistic sensors or the paper's."""
    size, path, wind, _ = ROWS[row]
    azimuth = 2.0 * np.pi * np.arange(n) / n
    radius = 0.0 if n == 1 else RADIUS[size]
    contacts = np.stack(
        [radius * np.cos(azimuth), radius * np.sin(azimuth), np.full(n, 0.5 * size[2])], axis=1
    )
    held = SuspendedPayload.from_contacts(
        Payload.from_box(size, 0.25), contacts, [[0.0, 0.0, 1.0]] * n
    )
    sensors = SensorParameters() if realistic else None
    station = StationParameters(air=AirParameters(), wind=wind, sensors=sensors)
    if isinstance(path, float):
        model = believed_model(
            "true",
            held.payload,
            held.p_LC,
            quadrotors=station.quadrotors(n),
            cable=station.cable,
            gripper=station.gripper,
            air=station.air,
        )
        path = line(path, model)
    return Flight(
        held,
        FlightOptions(
            belief="true",
            controller=MpcParameters(),
            trajectory=path,
            parameters=station,
            path_limits=None,  # three quadrotors over the small box come closer than it allows
        ),
    )


def errors(flight: Flight, seed: int) -> tuple[float, float, str]:
    """Return RMSE and largest error over the path [cm], and the outcome."""
    result = flight.run(seed)
    series, phases = result.series, flight.trajectory.phases
    moving = next(phase for phase in phases if phase.name == "path")
    during = (series["time"] >= moving.start) & (series["time"] <= moving.end)
    gap = series["payload_position"][during] - series["reference_position"][during]
    size = 100.0 * np.linalg.norm(gap, axis=1)
    reason = result.metrics["outcome_reason"]
    return float(np.sqrt((size**2).mean())), float(size.max()), reason or "completed"


def cost(repeats: int) -> None:
    """Print times of the MPC's step and of a flight, in air over without air."""
    box = Payload.from_box(LARGE, 0.25)
    for n in (1, 3):
        azimuth = 2.0 * np.pi * np.arange(n) / n
        radius = 0.0 if n == 1 else RADIUS[LARGE]
        places = [[radius * np.cos(a), radius * np.sin(a), 0.14] for a in azimuth]
        held = SuspendedPayload.from_contacts(box, places, [[0.0, 0.0, 1.0]] * n)
        flights = {
            name: Flight(held, FlightOptions(belief="true", parameters=StationParameters(air=air)))
            for name, air in (("none", None), ("air", AirParameters()))
        }
        steps: dict[str, list[float]] = {name: [] for name in flights}
        whole: dict[str, list[float]] = {name: [] for name in flights}
        for seed in range(repeats + 1):
            for name, flight in flights.items():
                began = time.thread_time()
                metrics = flight.run(seed).metrics
                whole[name].append(time.thread_time() - began)
                steps[name].append(metrics["timing"]["mpc_step_ms"]["mean"])
        step = {name: float(np.median(values[1:])) for name, values in steps.items()}
        total = {name: float(np.median(values[1:])) for name, values in whole.items()}
        print(
            f"n = {n}: step {step['none']:.2f} ms without air, {step['air']:.2f} ms in air, "
            f"{step['air'] / step['none']:.2f} times; flight {total['none']:.2f} s, "
            f"{total['air']:.2f} s, {total['air'] / total['none']:.2f} times",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", default="", help="only rows with this text")
    parser.add_argument("--n", nargs="+", type=int, default=[1, 3], help="quadrotors")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=100, help="first seed")
    parser.add_argument(
        "--sensors",
        choices=("paper", "payload"),
        default="payload",
        help="1 cm of noise on the payload's position alone, or realistic motion capture",
    )
    parser.add_argument("--cost", action="store_true", help="times only")
    arguments = parser.parse_args()
    if arguments.cost:
        cost(arguments.seeds if arguments.seeds < 10 else 3)
        return 0
    print(f"{'path':<36}{'n':>2}{'RMSE [cm]':>18}{'largest':>9}{'wanted':>8}  not completed")
    missed = 0
    for row, (_, path, _, wanted) in ROWS.items():
        if arguments.rows not in row:
            continue
        for n in arguments.n:
            flight = prepare(row, n, arguments.sensors == "payload")
            found = [
                errors(flight, seed)
                for seed in range(arguments.first, arguments.first + arguments.seeds)
            ]
            rmse, largest = np.array([f[0] for f in found]), max(f[1] for f in found)
            reasons = [f[2] for f in found if f[2] != "completed"]
            missed += bool(reasons) or rmse.max() > wanted
            seconds = f" ({flight.trajectory.duration:.1f} s)" if isinstance(path, float) else ""
            print(
                f"{row + seconds:<36}{n:>2}{rmse.mean():>8.2f} ({rmse.max():.2f} max)"
                f"{largest:>9.1f}{wanted:>8.1f}  {len(reasons)} {'; '.join(sorted(set(reasons)))}",
                flush=True,
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
