#!/usr/bin/env python3
"""Simulated seconds per CPU second and RMSE on one circle: ours, udaan, rotorpy, crazyflow.

The circle: radius 1 m, two turns in 12 s with quintic timing, then 5 s of hover, from rest at its
start (hanging, or hovering), exact measurements. udaan flies a point mass on a cable, ours a
rigid box; rotorpy and crazyflow have no payload, so the vehicle itself flies the circle. Each
peer has the vehicle, controller, steps and gains of its own documentation: RMSE says what a user
gets, not which simulator is more exact. Peers get position, velocity and acceleration of the
circle, the inputs of their controllers.

The first flight includes imports, compilation and construction; the second does not.

    tools/run python tools/bench/peers.py                       all, each in a temporary venv
    tools/run python tools/bench/peers.py --peers udaan ours    some of them
    tools/run python tools/bench/peers.py --circle 24           at half the speed
    tools/run python tools/bench/peers.py --keep DIR            keep the environments
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

HOVER, HEIGHT = 5.0, 1.0
WORLDS = 1000

Point = tuple[np.ndarray, np.ndarray, np.ndarray]
# Two functions: put the vehicle at the start; fly and return the position errors (T, 3) [m].
Ready = tuple[Callable[[], None], Callable[[], np.ndarray]]


@dataclass(frozen=True)
class Circle:
    """Two turns, then hover."""

    time: float
    """What the two turns take [s]."""

    def __call__(self, t: float) -> Point:
        """Return position, velocity and acceleration at a time [s]."""
        tau = min(max(t / self.time, 0.0), 1.0)
        phase = tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
        rate = 30.0 * tau**2 * (1.0 - tau) ** 2 / self.time
        change = 60.0 * tau * (1.0 - 3.0 * tau + 2.0 * tau**2) / self.time**2
        angle, rate, change = 4.0 * np.pi * np.array([phase, rate, change])
        radial = np.array([np.cos(angle), np.sin(angle), 0.0])
        along = np.array([-radial[1], radial[0], 0.0])
        return radial + [0.0, 0.0, HEIGHT], rate * along, change * along - rate**2 * radial

    @property
    def whole(self) -> float:
        """Time of circle and hover [s]."""
        return self.time + HOVER


def nothing() -> None:
    """Do what has to be done before a flight that begins at the start anyway."""


def ours(circle: Circle) -> Ready:
    """Our default flight, from the air, with exact measurements and a known centre of mass."""
    from drake_aerial.plant.payload import Payload
    from drake_aerial.references.trajectory import TransportTrajectory
    from drake_aerial.simulation.flight import Flight
    from drake_aerial.simulation.flight_options import FlightOptions
    from drake_aerial.simulation.suspended_payload import SuspendedPayload

    box = SuspendedPayload.from_contacts(
        Payload.read("box_68x61x28"), [[0.0, 0.0, 0.14]], [[0.0, 0.0, 1.0]]
    )
    trajectory = TransportTrajectory.airborne(circle_time=circle.time, hover_time=HOVER)
    flight = Flight(box, FlightOptions(belief="true", trajectory=trajectory, noise=0.0))

    def fly() -> np.ndarray:
        series = flight.run().series
        return series["payload_position"] - series["reference_position"]

    return nothing, fly


def udaan(circle: Circle, model: Any) -> Ready:
    """A quadrotor with a point mass, flown as the model's own `simulate` does."""
    model.payload_controller.setpoint = circle

    def fly() -> np.ndarray:
        errors = []
        while model.t < circle.whole:
            errors.append(model.state.payload_position - circle(model.t)[0])
            model.step(model.payload_controller.compute(model.t, model.state))
        return np.array(errors)

    return lambda: model.reset(payload_position=circle(0.0)[0]), fly


def udaan_equations(circle: Circle) -> Ready:
    """The equations of motion with a massless rod."""
    from udaan.models.quadrotor_cspayload import QuadrotorCsPayloadBase

    return udaan(circle, QuadrotorCsPayloadBase())


def udaan_mujoco(circle: Circle) -> Ready:
    """Its default command's model: MuJoCo with a cable of links."""
    from udaan.models.quadrotor_cspayload import QuadrotorCsPayloadMujoco

    return udaan(circle, QuadrotorCsPayloadMujoco(render=False, cable_model="links"))


def rotorpy(circle: Circle) -> Ready:
    """The Hummingbird without a payload; its rotors start at the speed of hovering."""
    from rotorpy.controllers.quadrotor_control import SE3Control
    from rotorpy.environments import Environment
    from rotorpy.vehicles.hummingbird_params import quad_params
    from rotorpy.vehicles.multirotor import Multirotor

    class Wanted:
        def update(self, t: float) -> dict[str, Any]:
            p, v, a = circle(t)
            rest = dict.fromkeys(("x_dddot", "x_ddddot"), np.zeros(3))
            return {
                "x": p,
                "x_dot": v,
                "x_ddot": a,
                **rest,
                "yaw": 0.0,
                "yaw_dot": 0.0,
                "yaw_ddot": 0.0,
            }

    vehicle = Multirotor(quad_params)
    hover = np.sqrt(quad_params["mass"] * 9.81 / (4.0 * quad_params["k_eta"]))
    vehicle.initial_state = {
        **vehicle.initial_state,
        "x": circle(0.0)[0],
        "rotor_speeds": np.full(4, hover),
    }
    environment = Environment(vehicle, SE3Control(quad_params), Wanted(), sim_rate=100)

    def fly() -> np.ndarray:
        flown = environment.run(t_final=circle.whole, terminate=False)
        return flown["state"]["x"] - np.array([circle(t)[0] for t in flown["time"]])

    return nothing, fly


def crazyflow(circle: Circle, worlds: int = 1) -> Ready:
    """One drone per world, without a payload; its rotors start at rest, so it hovers for 3 s."""
    import jax.numpy as jnp
    from crazyflow.control import Control
    from crazyflow.sim import Sim

    sim = Sim(n_worlds=worlds, control=Control.state)
    step = 1.0 / sim.control_freq
    # Position, velocity, acceleration, quaternion x y z w, angular velocity.
    command = np.zeros((worlds, 1, 16), dtype=np.float32)
    command[..., 12] = 1.0

    def track(seconds: float, wanted: Callable[[float], Point]) -> np.ndarray:
        errors = []
        for k in range(round(seconds / step)):
            p, v, a = wanted(k * step)
            errors.append(np.asarray(sim.data.states.pos)[0, 0] - p)
            command[..., 0:9] = np.concatenate([p, v, a])
            sim.state_control(jnp.asarray(command))
            sim.step(sim.freq // sim.control_freq)
        return np.array(errors)

    def begin() -> None:
        sim.reset()
        states = sim.data.states
        start = jnp.broadcast_to(
            jnp.asarray(circle(0.0)[0], dtype=states.pos.dtype), states.pos.shape
        )
        sim.data = sim.data.replace(states=states.replace(pos=start))
        track(3.0, lambda t: circle(0.0))

    return begin, lambda: track(circle.whole, circle)


@dataclass
class Peer:
    """One line of the table."""

    make: Callable[[Circle], Ready]
    package: str | None
    """What pip installs; None: it is us."""
    what: str
    not_modelled: str
    worlds: int = 1


PEERS = {
    "ours": Peer(
        ours,
        None,
        "rigid box 0.25 kg, quadrotor 0.25 kg, cable 0.5 m; Drake, plant 5 ms; "
        "attitude law at every step, MPC 25 plans a second over 50 Hz samples",
        "cable's mass, drag and bending, rotor and body drag, downwash "
        "(it has motor lag and wind, off here)",
    ),
    "udaan": Peer(
        udaan_equations,
        "udaan==1.3.0",
        "point mass 0.2 kg, quadrotor 0.9 kg, massless rod 1 m; equations of motion, "
        "Euler 1.25 ms; geometric control 200 Hz",
        "payload's attitude, slack cable, rotors, ground, noise",
    ),
    "udaan-mujoco": Peer(
        udaan_mujoco,
        "udaan==1.3.0",
        "the same controller on its default command's model: MuJoCo 2 ms, cable of links; "
        "control 200 Hz",
        "payload's attitude, rotors (it has slack and ground)",
    ),
    "rotorpy": Peer(
        rotorpy,
        "rotorpy==3.0.0",
        "Hummingbird 0.5 kg without payload; RK45 per step of 10 ms; geometric control 100 Hz; "
        "IMU and motion capture are simulated, too",
        "payload, cable (it has rotor lag, drag, wind, sensors)",
    ),
    "crazyflow": Peer(
        crazyflow,
        "crazyflow==0.4.0",
        "Crazyflie 2.1 brushless without payload; first principles, Euler 2 ms, float32; "
        "Mellinger control: position 100 Hz, attitude 500 Hz",
        "payload, cable, effects of contacts (it has rotor dynamics and drag)",
    ),
    "crazyflow-1000": Peer(
        lambda circle: crazyflow(circle, WORLDS),
        "crazyflow==0.4.0",
        f"the same in {WORLDS} worlds at once, which is what it is made for",
        "the same",
        WORLDS,
    ),
}


def measure(name: str, circle: Circle) -> dict[str, float]:
    """Fly one peer in this process; return CPU seconds of both flights and errors [m]."""
    began = time.process_time()
    begin, fly = PEERS[name].make(circle)
    begin()
    fly()
    first = time.process_time() - began
    begin()
    began = time.process_time()
    errors = fly()
    second = time.process_time() - began
    distance = np.linalg.norm(errors, axis=1)
    return {
        "first": first,
        "second": second,
        "rmse": float(np.sqrt((distance**2).mean())),
        "horizontal": float(np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean())),
        "peak": float(distance.max()),
        "last": float(distance[-1]),
    }


def in_environment(name: str, circle: Circle, folder: Path) -> dict[str, float]:
    """Return the figures of one peer from a process of its own; install the peer if needed."""
    python = Path(sys.executable)
    package = PEERS[name].package
    if package is not None:
        home = folder / package.replace("==", "-")
        python = home / "bin" / "python"
        if not (home / "installed").exists():
            subprocess.run([sys.executable, "-m", "venv", str(home)], check=True)
            subprocess.run([str(python), "-m", "pip", "install", "--quiet", package], check=True)
            (home / "installed").touch()
    command = [
        str(python),
        str(Path(__file__).resolve()),
        "--fly",
        name,
        "--circle",
        str(circle.time),
    ]
    # What a peer logs beside itself stays in the throw-away folder.
    folder.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{name}:\n{done.stderr}")
    return json.loads(done.stdout.splitlines()[-1])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", nargs="+", choices=list(PEERS), default=list(PEERS))
    parser.add_argument(
        "--circle",
        type=float,
        default=12.0,
        metavar="S",
        help="time of the two turns (default: 12)",
    )
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep the environments there")
    parser.add_argument("--fly", choices=list(PEERS), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    circle = Circle(arguments.circle)
    if arguments.fly:
        print(json.dumps(measure(arguments.fly, circle)))
        return 0
    heads = (
        "sim. s / CPU s",
        "first flight, CPU s",
        "second",
        "RMSE cm",
        "horizontal",
        "peak",
        "at the end",
    )
    print(" " * 16 + "".join(f"{head:>{max(len(head), 8) + 2}}" for head in heads))
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.peers:
            result = in_environment(name, circle, (arguments.keep or Path(folder)).resolve())
            seconds = [
                PEERS[name].worlds * circle.whole / result["second"],
                result["first"],
                result["second"],
            ]
            row = seconds + [100.0 * result[key] for key in ("rmse", "horizontal", "peak", "last")]
            print(
                f"{name:<16}"
                + "".join(
                    f"{value:>{max(len(head), 8) + 2}.2f}"
                    for head, value in zip(heads, row, strict=True)
                ),
                flush=True,
            )
    for name in arguments.peers:
        peer = PEERS[name]
        print(
            f"\n{name} ({peer.package or 'drake_aerial'}): {peer.what}\n"
            f"    not modelled: {peer.not_modelled}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
