#!/usr/bin/env python3
"""Random paths: which start, which fail, what retiming costs, and how close it is to an optimum.

"random": lines, legs and circles of random size and duration for four set-ups. Paths that the
check accepts are flown, and of those that it refuses the retimed ones and, with --forced, the paths
themselves. The measured position has 1 cm of noise; the controller knows the payload.
"optimum": lines in a vertical plane, by the fastest retiming and by Drake's DirectCollocation of a
slung load (a point mass on one cable), with the payload on the line and without.

    tools/run python tools/bench/paths.py                                 (about 60 CPU minutes)
    tools/run python tools/bench/paths.py --parts random --paths 100 --fly 20
    tools/run python tools/bench/paths.py --parts optimum --lines 5
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

import numpy as np

from drake_aerial import CarriedPayload, carried_payload, check_path, retime
from drake_aerial.dynamics.path_limits import PathLimits
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import JobError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import (
    LineTrajectory,
    TransportTrajectory,
    WaypointTrajectory,
)
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.statics.gravity import GRAVITY

UP = (0.0, 0.0, 1.0)
TRIANGLE = np.array([[-0.154, -0.267, 0.1], [0.308, 0.0, 0.1], [-0.154, 0.267, 0.1]])
# Mass of the payload, contacts, length of the cables.
SETUPS = {
    "one": (0.25, np.array([[0.0, 0.0, 0.1]]), 0.5),
    "one, CoM 10 cm off": (0.25, np.array([[0.1, 0.0, 0.1]]), 0.5),
    "one, cable 1.5 m": (0.25, np.array([[0.0, 0.0, 0.1]]), 1.5),
    "three, CoM 5 cm off": (0.6, TRIANGLE + [0.05, 0.0, 0.0], 0.5),
}
AIRBORNE = {"ground_time": 0.0, "lift_time": 0.0, "hover_time": 0.5}


def setup(name):
    """Return a flight of a set-up that checks nothing, and what the check needs."""
    mass, contacts, length = SETUPS[name]
    box = Payload.from_box([0.8, 0.8, 0.2], mass)
    held = SuspendedPayload.from_contacts(box, contacts, np.tile(UP, (len(contacts), 1)))
    # A payload that is swung far down must not touch the ground.
    station = StationParameters(cable=CableParameters(length=length), airborne_height=8.0)
    options = FlightOptions(belief="true", parameters=station, path_limits=None)
    return Flight(held, options), carried_payload(held, station)


def random_path(rng):
    """Return a path of random kind, size and duration."""
    pace = float(np.exp(rng.uniform(np.log(0.4), np.log(2.5))))
    kind = rng.choice(["line", "waypoints", "circle"])
    if kind == "line":
        step = rng.uniform(-3.0, 3.0, 3) * [1.0, 1.0, 0.5]
        duration = pace * (1.0 + 0.8 * np.sqrt(np.linalg.norm(step)))
        return LineTrajectory(displacement=tuple(step), line_time=duration, **AIRBORNE)
    if kind == "waypoints":
        points = np.cumsum(rng.uniform(-1.5, 1.5, (2, 3)) * [1.0, 1.0, 0.4], axis=0)
        lengths = np.linalg.norm(np.diff(points, axis=0, prepend=np.zeros((1, 3))), axis=1)
        times = pace * (1.0 + 0.8 * np.sqrt(lengths))
        points = tuple(tuple(p) for p in points)
        return WaypointTrajectory(waypoints=points, leg_times=tuple(times), **AIRBORNE)
    radius, turns = rng.uniform(0.4, 1.5), rng.uniform(0.5, 1.2)
    duration = pace * (1.0 + 3.5 * turns * np.sqrt(radius))
    return TransportTrajectory.airborne(
        radius=radius, turns=turns, circle_time=duration, hover_time=0.5
    )


def fly(flight, paths, count):
    """Return outcomes and errors [cm] of the shortest paths, and the longest slack."""
    chosen = sorted(paths, key=lambda path: path.duration)[:: max(1, len(paths) // max(count, 1))]
    outcomes, errors = Counter(), []
    for seed, path in enumerate(chosen[:count]):
        flight.trajectory = path
        result = flight.run(seed)
        outcomes[result.outcome] += 1
        if result.outcome != "completed":
            print(f"    {result.metrics['outcome_reason']}: {path}", flush=True)
        errors.append(100.0 * (result.metrics["position_rmse_m"] or np.nan))
    return outcomes, errors


def line_of(what, outcomes, errors):
    flown = sum(outcomes.values())
    if not flown:
        return f"  {what}: none flown"
    quantiles = np.nanpercentile(errors, [50, 90, 100])
    return (
        f"  {what}: {outcomes['completed']} of {flown} completed, RMSE median "
        f"{quantiles[0]:.1f} cm, p90 {quantiles[1]:.1f}, worst {quantiles[2]:.1f}"
    )


def random_paths(count, flown, seed, forced):
    """Print a block per set-up."""
    print("random paths")
    for index, name in enumerate(SETUPS):
        rng = np.random.default_rng([seed, index])
        flight, carried = setup(name)
        possible, impossible, retimed, refused = [], [], [], Counter()
        why, longer, begin = Counter(), [], time.process_time()
        for _ in range(count // len(SETUPS)):
            path = random_path(rng)
            check = check_path(path, carried)
            if check.feasible:
                possible.append(path)
                continue
            impossible.append(path)
            why[check.violations[0].what] += 1
            try:
                retimed.append(retime(path, carried))
                longer.append(retimed[-1].duration / path.duration)
            except JobError as error:
                refused[str(error)] += 1
        cpu = time.process_time() - begin
        print(
            f"{name}: {len(possible)} possible, {len(impossible)} impossible "
            f"({', '.join(f'{n} {what}' for what, n in why.most_common())}), "
            f"{len(retimed)} retimed (median {np.median(longer):.2f} times as long), "
            f"{cpu:.0f} CPU s",
            flush=True,
        )
        for reason, n in refused.items():
            print(f"  {n} times: {reason}")
        print(line_of("possible", *fly(flight, possible, flown)), flush=True)
        print(line_of("retimed", *fly(flight, retimed, flown)), flush=True)
        if forced:
            print(line_of("impossible, by force", *fly(flight, impossible, flown)), flush=True)


MASS, OWN, LENGTH = 0.25, 0.25, 0.5
LIMITS = PathLimits()
KNOTS = 41


def collocated(goal, on_line, guess):
    """Return the shortest time of a slung load to `goal` (2,) in a vertical plane [s], or None."""
    from pydrake.planning import DirectCollocation
    from pydrake.solvers import SnoptSolver, SolverOptions
    from pydrake.symbolic import Variable, cos, sin
    from pydrake.systems.primitives import SymbolicVectorSystem
    from pydrake.trajectories import PiecewisePolynomial

    state = [Variable(n) for n in ("x", "z", "a", "vx", "vz", "w")]
    a, vx, vz, w = state[2:]
    fx, fz = [Variable(n) for n in ("fx", "fz")]
    along = fx * sin(a) + fz * cos(a)
    tension = (along + OWN * LENGTH * w * w) * MASS / (MASS + OWN)
    turning = (fx * cos(a) - fz * sin(a)) / (OWN * LENGTH)
    rates = [vx, vz, w, tension * sin(a) / MASS, tension * cos(a) / MASS - GRAVITY, turning]
    system = SymbolicVectorSystem(state=state, input=[fx, fz], dynamics=rates, output=state)
    program = DirectCollocation(
        system, system.CreateDefaultContext(), KNOTS, 0.2 * guess / KNOTS, 2.0 * guess / KNOTS
    )
    program.AddEqualTimeIntervalsConstraints()
    hover = GRAVITY * (MASS + OWN)
    most = 7.07 - LIMITS.thrust_margin * (7.07 - hover)
    least = 0.8 + LIMITS.thrust_margin * (hover - 0.8)
    u, s = program.input(), program.state()
    program.AddConstraintToAllKnotPoints(u[0] ** 2 + u[1] ** 2 <= most**2)
    program.AddConstraintToAllKnotPoints(u[0] ** 2 + u[1] ** 2 >= least**2)
    steep = np.tan(LIMITS.tilt)
    for sign in (-1.0, 1.0):
        program.AddConstraintToAllKnotPoints(sign * u[0] <= steep * u[1])
    pull = u[0] * sin(s[2]) + u[1] * cos(s[2]) + OWN * LENGTH * s[5] ** 2
    taut = LIMITS.tension * GRAVITY * MASS
    program.AddConstraintToAllKnotPoints(pull * MASS / (MASS + OWN) >= taut)
    if on_line:
        program.AddConstraintToAllKnotPoints(goal[1] * s[0] - goal[0] * s[1] == 0.0)
    start, end = np.zeros(6), np.array([goal[0], goal[1], 0.0, 0.0, 0.0, 0.0])
    program.prog().AddBoundingBoxConstraint(start, start, program.initial_state())
    program.prog().AddBoundingBoxConstraint(end, end, program.final_state())
    rest = GRAVITY * (MASS + OWN)
    for knot in (0, KNOTS - 1):
        program.prog().AddBoundingBoxConstraint([0.0, rest], [0.0, rest], program.input(knot))
    program.prog().AddLinearCost(sum(program.time_step(k)[0] for k in range(KNOTS - 1)))
    first = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(
        [0.0, 0.5 * guess, guess], np.array([start, 0.5 * end, end]).T, np.zeros(6), np.zeros(6)
    )
    hold = PiecewisePolynomial.ZeroOrderHold([0.0, guess], np.tile([[0.0], [rest]], 2))
    program.SetInitialTrajectory(hold, first)
    options = SolverOptions()
    options.SetOption(SnoptSolver.id(), "Major iterations limit", 600)
    result = SnoptSolver().Solve(program.prog(), solver_options=options)
    if not result.is_success():
        return None
    return float(program.GetSampleTimes(result)[-1])


def optimum(count, seed):
    """Print duration by `retime` and by DirectCollocation for random lines."""
    rng = np.random.default_rng(seed)
    model = PayloadModelParameters(
        MASS, 0.006 * np.eye(3), [[0.0, 0.0, 0.0]], quadrotor_mass=OWN, cable_length=LENGTH
    )
    carried = CarriedPayload.of_model(model)
    print("length [m], slope [deg]: slower, fastest, collocation on the line, free [s]; CPU s")
    ratios = []
    for _ in range(count):
        length, slope = rng.uniform(1.0, 8.0), rng.uniform(-0.6, 0.6)
        goal = length * np.array([np.cos(slope), np.sin(slope)])
        line = LineTrajectory(displacement=(goal[0], 0.0, goal[1]), line_time=0.5, **AIRBORNE)
        times = []
        begin = time.process_time()
        for mode in ("slower", "fastest"):
            phase = retime(line, carried, mode=mode).phase("line")
            times.append(phase.end - phase.start)
        ours, begin = time.process_time() - begin, time.process_time()
        best = [collocated(goal, on_line, times[-1]) for on_line in (True, False)]
        theirs = time.process_time() - begin
        found = ", ".join("failed" if t is None else f"{t:.2f}" for t in best)
        if best[0] is not None:
            ratios.append(times[-1] / best[0])
        print(
            f"{length:.1f}, {np.rad2deg(slope):+.0f}: {times[0]:.2f}, {times[1]:.2f}, {found}; "
            f"{ours:.1f}, {theirs:.1f}",
            flush=True,
        )
    if ratios:
        print(
            f"fastest over collocation on the line: median {np.median(ratios):.3f}, worst "
            f"{max(ratios):.3f} of {len(ratios)}"
        )


def main() -> int:
    """Run the parts that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", nargs="+", choices=("random", "optimum"), default=None)
    parser.add_argument("--paths", type=int, default=1000, help="random paths (default: 1000)")
    parser.add_argument(
        "--fly", type=int, default=50, help="flights per set-up and kind (default: 50)"
    )
    parser.add_argument("--forced", action="store_true", help="fly impossible paths by force too")
    parser.add_argument("--lines", type=int, default=20, help="lines of the optimum (default: 20)")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    if given.parts is None or "random" in given.parts:
        random_paths(given.paths, given.fly, given.seed, given.forced)
    if given.parts is None or "optimum" in given.parts:
        optimum(given.lines, given.seed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
