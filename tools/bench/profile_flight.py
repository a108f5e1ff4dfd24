#!/usr/bin/env python3
"""CPU time of a flight by part, for one and three quadrotors, and of the bare Drake step.

A flight is the transport task (25 s: lift, approach, two turns of a 1 m circle in 12 s, 5 s of
hover, 1 cm of noise on the measured position) of the box 68x61x28 by the MPC with the true centre
of mass. It is simulated once for speed and the MPC's step, and once with a clock around every part.

The bare step is that of a plant with the same bodies, cables and geometries under constant forces,
from states of that flight. The station's step is that of the same plant with its propellers,
cables, attitude loop, sensors and logs, at rest under constant thrusts, without a controller. All
times are CPU times of one thread.

    tools/run python tools/bench/profile_flight.py
    tools/run python tools/bench/profile_flight.py --n 3 --seed 7
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import drake_aerial.control.controller as controller
import drake_aerial.control.mpc.payload_mpc as mpc
import drake_aerial.control.mpc.tracking_cost as cost
import drake_aerial.simulation.flight as flight
from drake_aerial.control.attitude import AttitudeController
from drake_aerial.estimation.state_sensor import StateSensor
from drake_aerial.plant.cable import add_cable
from drake_aerial.plant.cable_forces import GripperRelease
from drake_aerial.plant.cable_tensions import CableTensions
from drake_aerial.plant.gripper import add_gripper
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import add_quadrotor
from drake_aerial.plant.world import add_ground, add_plant
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.outcome import FlightMonitor
from drake_aerial.simulation.station import TransportStation, make_transport_station
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.statics.gravity import GRAVITY

CONTACTS = {
    1: [[0.0, 0.0, 0.14]],
    3: [[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]],
}
SPEED_WANTED, STEP_WANTED = {1: 12.0, 3: 8.0}, {1: 1.0, 3: 2.5}
SNAPSHOTS = (7.0, 9.0, 11.0, 13.0, 15.0, 17.0, 19.0, 23.0)
"""Times of a flight [s] at whose states the bare plant is timed."""

DRAKE = "Drake: step, propellers, logs, events"
# Label, owner, attribute; a clock is put around the attribute.
PARTS: list[tuple[str, Any, str]] = [
    ("prepare: place, reference, monitor", TransportStation, "place"),
    ("prepare: place, reference, monitor", FlightMonitor, "__init__"),
    (DRAKE, flight.Simulator, "AdvanceTo"),
    ("attitude and allocation", AttitudeController, "_calc_commands"),
    ("perception", StateSensor, "_sample"),
    ("tensions", CableTensions, "_calc"),
    ("monitor: release of grippers", GripperRelease, "__call__"),
    ("monitor: outcome", FlightMonitor, "__call__"),
    ("control step: ports, filter, take-off", controller.PayloadController, "_control_step"),
    ("MPC: last plan, measured state", mpc.PayloadMpc, "compute_thrusts"),
    ("MPC: reference", mpc, "reference_table"),
    ("MPC: reference", mpc.ReferenceTable, "at"),
    ("MPC: linearisation", mpc, "linearize"),
    ("MPC: discretisation", mpc, "discretize"),
    ("MPC: change of chart", mpc, "change_chart"),
    ("MPC: cost", mpc.PayloadMpc, "_improve"),
    ("MPC: cost", cost.TrackingCost, "quadratic"),
    ("MPC: cost", cost.TrackingCost, "terminal"),
    ("MPC: condensing", mpc.CondensedProblem, "condense"),
    ("MPC: quadratic program", mpc.BoxProgram, "solve"),
    ("MPC: new plan", mpc.CondensedProblem, "expand"),
    ("MPC: new plan", mpc, "retract"),
    ("series and metrics", flight, "record"),
    ("series and metrics", flight, "flight_metrics"),
]


class Clock:
    """CPU seconds and calls by label; time in a nested part counts for the nested part only."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self.calls: defaultdict[str, int] = defaultdict(int)
        self._running: list[str] = []
        self._since = 0.0

    def around(self, label: str, function: Callable) -> Callable:
        """Return the function with the clock around it."""

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._turn_to(label)
            self.calls[label] += 1
            try:
                return function(*arguments, **keywords)
            finally:
                self._turn_to(None)

        return timed

    def _turn_to(self, label: str | None) -> None:
        now = time.thread_time()
        if self._running:
            self.seconds[self._running[-1]] += now - self._since
        if label is None:
            self._running.pop()
        else:
            self._running.append(label)
        self._since = time.thread_time()


def main() -> int:
    arguments = parse()
    for n in arguments.n:
        profile(n, arguments.seed, make_options(arguments))
    return 0


def profile(n: int, seed: int, options: dict[str, Any]) -> None:
    """Fly with n quadrotors and print the table."""
    subject = make_flight(n, options)
    subject.run(seed)
    began = time.thread_time()
    metrics = subject.run(seed).metrics
    total = time.thread_time() - began
    step = metrics["timing"]["mpc_step_ms"]
    speed = metrics["timing"]["real_time_factor"]
    clock, states = Clock(), []
    timed_total = fly_with_clock(n, seed, options, clock, states)
    bare = bare_step(n, states)
    steps = round(metrics.get("duration_s", subject.trajectory.duration) / StationParameters().step)

    print(
        f"\n{n} quadrotor(s), seed {seed}: {metrics['outcome']}, "
        f"RMSE {100 * metrics['position_rmse_m']:.2f} cm"
    )
    print(
        f"  {speed:.2f} simulated s per CPU s (wanted {SPEED_WANTED[n]:g}); "
        f"whole trial {total:.2f} CPU s"
    )
    print(
        f"  MPC step {step['mean']:.2f} ms mean (wanted {STEP_WANTED[n]:g}), "
        f"p99 {step['p99']:.2f} ms"
    )
    print(f"  {'part':<40}{'calls':>7}{'us/call':>9}{'s':>7}{'%':>6}")
    order = list(dict.fromkeys(label for label, _, _ in PARTS))
    for label in order:
        if clock.calls[label]:
            seconds, calls = clock.seconds[label], clock.calls[label]
            each, share = 1e6 * seconds / calls, 100 * seconds / timed_total
            print(f"  {label:<40}{calls:>7}{each:>9.1f}{seconds:>7.2f}{share:>6.1f}")
    control = sum(
        clock.seconds[label] for label in order if label.startswith(("MPC", "control step"))
    )
    outside = sum(
        clock.seconds[label] for label in order if label.startswith(("prepare", "series"))
    )
    plant = (sum(clock.seconds.values()) - control - outside) / steps
    print(f"  {'sum (with the clock on)':<40}{'':>7}{'':>9}{sum(clock.seconds.values()):>7.2f}")
    station = station_step(n)
    print(f"  step of the plant: bare {1e6 * bare:.0f} us")
    print(
        f"    with our systems, no controller {1e6 * station:.0f} us, "
        f"{station / bare:.2f} times (wanted 1.5)"
    )
    print(
        f"    in flight, all but the controller {1e6 * plant:.0f} us, {plant / bare:.2f} times",
        flush=True,
    )


def make_flight(n: int, options: dict[str, Any]) -> flight.Flight:
    """Return the flight to profile."""
    box = Payload.read("box_68x61x28")
    return flight.Flight(
        SuspendedPayload.from_contacts(box, CONTACTS[n], [[0.0, 0.0, 1.0]] * n),
        FlightOptions(belief="true", controller_options=options),
    )


def fly_with_clock(
    n: int, seed: int, options: dict[str, Any], clock: Clock, states: list[np.ndarray]
) -> float:
    """Return the CPU seconds of a flight with a clock around every part.

    `states` is filled with the plant's states at `SNAPSHOTS`.
    """
    kept = [(owner, name, owner.__dict__[name]) for _, owner, name in PARTS]
    look, due = FlightMonitor.__call__, list(SNAPSHOTS)

    def snapshot(monitor: FlightMonitor, context: Any) -> Any:
        if due and context.get_time() >= due[0]:
            due.pop(0)
            plant = monitor._station.plant
            states.append(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)))
        return look(monitor, context)

    try:
        FlightMonitor.__call__ = snapshot
        for label, owner, name in PARTS:
            setattr(owner, name, clock.around(label, owner.__dict__[name]))
        subject = make_flight(n, options)
        clock.seconds.clear()
        clock.calls.clear()
        began = time.thread_time()
        subject.run(seed)
        return time.thread_time() - began
    finally:
        for owner, name, function in kept:
            setattr(owner, name, function)


def bare_step(n: int, states: list[np.ndarray], steps: int = 100) -> float:
    """Return the CPU seconds of a step of the plant alone, with its scene graph only."""
    builder, parameters = DiagramBuilder(), StationParameters()
    plant, _ = add_plant(builder, parameters.step)
    add_ground(plant)
    suspension = SuspendedPayload.from_contacts(
        Payload.read("box_68x61x28"), CONTACTS[n], [[0.0, 0.0, 1.0]] * n
    )
    payload = add_payload(plant, suspension.payload)
    quadrotors = [add_quadrotor(plant, name=f"quadrotor_{i}") for i in range(n)]
    for i, quadrotor in enumerate(quadrotors):
        gripper = add_gripper(
            plant, payload, suspension.p_LC[i], suspension.normal_L[i], name=f"gripper_{i}"
        )
        add_cable(plant, quadrotor, gripper, name=f"cable_{i}")
    plant.Finalize()
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    context = simulator.get_mutable_context()
    own = plant.GetMyMutableContextFromRoot(context)
    lift = GRAVITY * plant.CalcTotalMass(own) / n
    times = []
    for state in states:
        plant.SetPositionsAndVelocities(own, state)
        plant.get_applied_spatial_force_input_port().FixValue(
            own, _push(plant, own, quadrotors, lift)
        )
        began = time.thread_time()
        simulator.AdvanceTo(context.get_time() + steps * parameters.step)
        times.append((time.thread_time() - began) / steps)
    return float(np.median(times))


def station_step(n: int, seconds: float = 1.0, times: int = 8) -> float:
    """Return the CPU seconds of a step of the station under constant thrusts."""
    suspension = SuspendedPayload.from_contacts(
        Payload.read("box_68x61x28"), CONTACTS[n], [[0.0, 0.0, 1.0]] * n
    )
    station = make_transport_station(suspension.payload, suspension.p_LC, suspension.normal_L)
    spent = []
    for _ in range(times):
        simulator = Simulator(station)
        context = simulator.get_mutable_context()
        station.place(context, reference=HoverTrajectory())
        weight = GRAVITY * station.plant.CalcTotalMass(station.plant.GetMyContextFromRoot(context))
        lift = np.tile([0.0, 0.0, weight / n], n)
        station.GetInputPort("attitude.thrust_vectors").FixValue(context, lift)
        simulator.Initialize()
        began = time.thread_time()
        simulator.AdvanceTo(seconds)
        spent.append((time.thread_time() - began) * station.parameters.step / seconds)
    return float(np.median(spent))


def _push(
    plant: MultibodyPlant, context: Any, quadrotors: list, size: float
) -> list[ExternallyAppliedSpatialForce]:
    forces = []
    for quadrotor in quadrotors:
        force = ExternallyAppliedSpatialForce()
        force.body_index = quadrotor.body.index()
        X_WQ: RigidTransform = plant.EvalBodyPoseInWorld(context, quadrotor.body)
        force.F_Bq_W = SpatialForce(np.zeros(3), size * X_WQ.rotation().matrix()[:, 2])
        forces.append(force)
    return forces


def make_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the given options of the controller."""
    return {} if arguments.stages is None else {"stages": arguments.stages}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--n",
        nargs="+",
        type=int,
        choices=list(CONTACTS),
        default=list(CONTACTS),
        help="quadrotors",
    )
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--stages", type=int, help="stages of the MPC's horizon")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
