#!/usr/bin/env python3
"""Simulated seconds per CPU second and RMSE on one circle, beside udaan, rotorpy and crazyflow.

The circle: radius 1 m, two turns in 12 s with quintic timing, then 5 s of hover, from hanging (or hovering) at its start, exact measurements.
udaan flies a point mass on a cable, as we do a rigid box; rotorpy and crazyflow have no payload, so the vehicle itself flies it. Each
peer has its own vehicle, controller, steps and gains as they come: RMSE says what a user gets, not which simulator is more exact.
The first flight counts what a newcomer waits for (imports, compilation), the second the flight alone.

    tools/run python tools/bench/peers.py                       everyone; each peer is installed into a throw-away environment
    tools/run python tools/bench/peers.py --peers udaan ours    some of them
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

PACKAGES = {
    "udaan": "udaan==1.3.0",
    "rotorpy": "rotorpy==3.0.0",
    "crazyflow": "crazyflow==0.4.0",
}
NOT_MODELLED = {
    "ours": "cable mass and drag, rotor aerodynamics",
    "udaan": "payload's attitude, slack cable, contact, ground, noise (its MuJoCo models have some of these)",
    "rotorpy": "payload, cable, contact between bodies (it has rotor lag, drag and wind)",
    "crazyflow": "payload, cable (it has rotor dynamics, drag, contacts and thousands of worlds at once)",
}
CIRCLE, HOVER, HEIGHT, STEP = 12.0, 5.0, 1.0, 0.01

Point = tuple[np.ndarray, np.ndarray, np.ndarray]


def circle(t: float) -> Point:
    """Return position, velocity and acceleration on the circle at a time [s]."""
    tau = min(max(t / CIRCLE, 0.0), 1.0)
    angle = (
        4.0
        * np.pi
        * np.array(
            [
                tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2),
                30.0 * tau**2 * (1.0 - tau) ** 2 / CIRCLE,
                60.0 * tau * (1.0 - 3.0 * tau + 2.0 * tau**2) / CIRCLE**2,
            ]
        )
    )
    radial = np.array([np.cos(angle[0]), np.sin(angle[0]), 0.0])
    along = np.array([-radial[1], radial[0], 0.0])
    return (
        radial + [0.0, 0.0, HEIGHT],
        angle[1] * along,
        angle[2] * along - angle[1] ** 2 * radial,
    )


def fly_ours() -> np.ndarray:
    """Return where the payload of our default flight was, less where it should have been (T, 3) [m]."""
    from drake_aerial.control.trajectory import TransportTrajectory
    from drake_aerial.plant.payload import Payload
    from drake_aerial.transport.flight import Flight
    from drake_aerial.transport.suspension import Suspension

    box = Suspension.hang(Payload.read("box_68x61x28"), [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]])
    trajectory = TransportTrajectory.airborne(circle_time=CIRCLE, hover_time=HOVER)
    series = Flight(box, belief="true", trajectory=trajectory, noise=0.0).run().series
    return series["payload_position"] - series["reference_position"]


def fly_udaan() -> np.ndarray:
    """The same of udaan's quadrotor with a point mass."""
    from udaan.models.quadrotor_cspayload import QuadrotorCsPayloadBase

    model = QuadrotorCsPayloadBase()
    model.payload_controller.setpoint = circle
    model.reset(payload_position=circle(0.0)[0])
    errors = []
    while model.t < CIRCLE + HOVER:
        errors.append(model.state.payload_position - circle(model.t)[0])
        model.step(model.payload_controller.compute(model.t, model.state))
    return np.array(errors)


def fly_rotorpy() -> np.ndarray:
    """The same of rotorpy's Hummingbird, without a payload."""
    from rotorpy.controllers.quadrotor_control import SE3Control
    from rotorpy.environments import Environment
    from rotorpy.vehicles.hummingbird_params import quad_params
    from rotorpy.vehicles.multirotor import Multirotor

    class Circle:
        def update(self, t: float) -> dict[str, Any]:
            p, v, a = circle(t)
            rest = dict.fromkeys(("x_dddot", "x_ddddot"), np.zeros(3))
            return {"x": p, "x_dot": v, "x_ddot": a, **rest, "yaw": 0.0, "yaw_dot": 0.0, "yaw_ddot": 0.0}

    vehicle = Multirotor(quad_params)
    vehicle.initial_state = {**vehicle.initial_state, "x": circle(0.0)[0]}
    environment = Environment(vehicle, SE3Control(quad_params), Circle(), sim_rate=100)
    flown = environment.run(t_final=CIRCLE + HOVER, terminate=False)
    return flown["state"]["x"] - np.array([circle(t)[0] for t in flown["time"]])


def fly_crazyflow() -> np.ndarray:
    """The same of one drone in one of crazyflow's worlds, without a payload."""
    import jax.numpy as jnp
    from crazyflow.control import Control
    from crazyflow.sim import Sim

    sim = Sim(control=Control.state)
    sim.reset()
    start = jnp.asarray(circle(0.0)[0], dtype=sim.data.states.pos.dtype)
    sim.data = sim.data.replace(states=sim.data.states.replace(pos=jnp.broadcast_to(start, sim.data.states.pos.shape)))
    command, errors = np.zeros((1, 1, 16), dtype=np.float32), []
    command[0, 0, 12] = 1.0
    for k in range(int((CIRCLE + HOVER) / STEP)):
        p, v, a = circle(k * STEP)
        errors.append(np.asarray(sim.data.states.pos)[0, 0] - p)
        command[0, 0, 0:9] = np.concatenate([p, v, a])
        sim.state_control(jnp.asarray(command))
        sim.step(int(round(sim.freq * STEP)))
    return np.array(errors)


FLIGHTS: dict[str, Callable[[], np.ndarray]] = {
    "ours": fly_ours,
    "udaan": fly_udaan,
    "rotorpy": fly_rotorpy,
    "crazyflow": fly_crazyflow,
}


def measure(name: str) -> dict[str, float]:
    """Return the figures of one peer in this process: CPU seconds of the first and second flight, RMSE [m]."""
    seconds, errors = [], np.zeros((1, 3))
    for _ in range(2):
        began = time.process_time()
        errors = FLIGHTS[name]()
        seconds.append(time.process_time() - began)
    return {"first": seconds[0], "second": seconds[1], "rmse": float(np.sqrt((errors**2).sum(axis=1).mean()))}


def in_environment(name: str, folder: Path) -> dict[str, float]:
    """Return the figures of one peer, flown by a Python of its own; a peer that is not ours is installed for it."""
    python = Path(sys.executable)
    if name in PACKAGES:
        subprocess.run([sys.executable, "-m", "venv", str(folder / name)], check=True)
        python = folder / name / "bin" / "python"
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", PACKAGES[name]], check=True)
    command = [str(python), str(Path(__file__).resolve()), "--fly", name]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", nargs="+", choices=list(FLIGHTS), default=list(FLIGHTS))
    parser.add_argument("--fly", choices=list(FLIGHTS), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.fly:
        print(json.dumps(measure(arguments.fly)))
        return 0
    print(f"{'':<18}{'sim. s / CPU s':>15}{'first flight, CPU s':>21}{'RMSE cm':>9}  not modelled")
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.peers:
            result = in_environment(name, Path(folder))
            speed = (CIRCLE + HOVER) / result["second"]
            label = PACKAGES.get(name, "ours")
            print(
                f"{label:<18}{speed:>15.1f}{result['first']:>21.1f}{100 * result['rmse']:>9.2f}  {NOT_MODELLED[name]}",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
