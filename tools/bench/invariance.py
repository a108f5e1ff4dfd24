#!/usr/bin/env python3
"""Invariance of contacts: random changes of a scan that must not move the best contact.

A case is a shipped demonstration of one gripper, a random sampling of a box of random size or of a
shipped payload, and one of these changes:

- yaw and translation, of any size;
- any rotation, with the direction of up rotated, too;
- the order of the points;
- every point given twice;
- another unit of length for demonstration, scan and all lengths of learning and transfer (radii,
  bandwidths, votes): 0.4 to 2.5 times.

The table shows how far the best contact of `task` moves, and the change of its likelihood.

    tools/run python tools/bench/invariance.py                200 cases (about 3 CPU minutes)
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from dataclasses import replace

import numpy as np
import trimesh

from drake_aerial import (
    ContactSkill,
    Demonstration,
    Payload,
    PointCloud,
    learn,
    read_skill,
    transfer,
)
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.geometry import Pose, quat_exp, rotate
from drake_aerial.geometry import transform as moved
from drake_aerial.skill.parameters import LearningParameters

CHANGES = ("yaw and translation", "any rotation", "order", "twice", "unit")
SKILLS = ("flat", "edge", "curved")
# Fewer chains than by default: what is compared is the same in both.
QUICK = TransferParameters(chains=30, steps=200, starts=150, kernels=400)
LENGTHS = ("vote_sigma", "step_position", "distinct", "clearance", "off_surface", "separation")


def cloud_points(rng: np.random.Generator) -> np.ndarray:
    """Return points of a random object [m]."""
    if rng.random() < 0.7:
        mesh = trimesh.creation.box(rng.uniform([0.3, 0.3, 0.15], [1.0, 0.8, 0.35]))
    else:
        payload = Payload.read(str(rng.choice(["bunny", "teapot"])))
        mesh = trimesh.Trimesh(payload.vertices, payload.faces, process=False)
    points = trimesh.sample.sample_surface(
        mesh, int(rng.integers(4000, 9000)), seed=int(rng.integers(2**31))
    )[0]
    return np.array(points)


def in_unit(factor: float, name: str) -> tuple[ContactSkill, TransferParameters]:
    """Return a skill and transfer parameters in another unit of length (metres times `factor`)."""
    shown = Demonstration.read(name)
    grippers, quadrotors = shown.grippers.p * factor, shown.quadrotors.p * factor
    viewpoint = None if shown.cloud.viewpoint is None else factor * shown.cloud.viewpoint
    cloud = PointCloud.read(factor * shown.cloud.points, viewpoint=viewpoint, up=shown.cloud.up)
    there = Demonstration.make(
        cloud,
        grippers,
        axes=rotate(shown.grippers.q, np.array([0.0, 0.0, 1.0])),
        cable_length=factor * shown.cable_length,
        cable_directions=quadrotors - grippers,
        name=name,
    )
    known = LearningParameters()
    learning = replace(
        known,
        features=replace(known.features, rho=factor * known.features.rho),
        bandwidth=replace(known.bandwidth, position=factor * known.bandwidth.position),
        contact_radius=factor * known.contact_radius,
        configuration_sigma=factor * known.configuration_sigma,
    )
    return learn(there, parameters=learning, seed=0), replace(
        QUICK, **{key: factor * getattr(QUICK, key) for key in LENGTHS}
    )


def change(
    kind: str, points: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, Pose, np.ndarray]:
    """Return the changed points, the pose from the old to the new frame, and the new up."""
    X = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    if kind == "order":
        return rng.permutation(points), X, np.array([0.0, 0.0, 1.0])
    if kind == "twice":
        return np.repeat(points, 2, axis=0), X, np.array([0.0, 0.0, 1.0])
    turn = (
        rng.uniform(-np.pi, np.pi, 3)
        if kind == "any rotation"
        else np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    )
    X = Pose(rng.uniform(-20.0, 20.0, 3), quat_exp(turn))
    return moved(X, points), X, rotate(X.q, np.array([0.0, 0.0, 1.0]))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200, help="(default: 200)")
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first case (default: 0)"
    )
    arguments = parser.parse_args()
    skills = {name: read_skill(name) for name in SKILLS}
    shifts, falls = defaultdict(list), defaultdict(list)
    for number in range(arguments.first, arguments.first + arguments.cases):
        rng = np.random.default_rng([31, number])
        kind, name = CHANGES[number % len(CHANGES)], str(rng.choice(SKILLS))
        points = cloud_points(rng)
        before = transfer(
            skills[name], PointCloud.read(points), top=1, seed=number, parameters=QUICK
        )[0]
        if kind == "unit":
            factor = float(np.exp(rng.uniform(np.log(0.4), np.log(2.5))))
            skill, parameters = in_unit(factor, name)
            after = transfer(
                skill, PointCloud.read(factor * points), top=1, seed=number, parameters=parameters
            )[0]
            shifts[kind].append(float(np.linalg.norm(after.X_SG.p / factor - before.X_SG.p)))
        else:
            other, X, up = change(kind, points, rng)
            after = transfer(
                skills[name], PointCloud.read(other, up=up), top=1, seed=number, parameters=QUICK
            )[0]
            shifts[kind].append(float(np.linalg.norm(after.X_SG.p - moved(X, before.X_SG.p))))
        falls[kind].append(abs(after.log_likelihood - before.log_likelihood))
        if shifts[kind][-1] > 0.005:
            print(
                f"  case {number} ({kind}, {name}): moved by {100 * shifts[kind][-1]:.2f} cm",
                flush=True,
            )
    print(
        f"{'change':<22}{'cases':>6}{'median m':>11}{'largest m':>11}{'over 5 mm':>11}"
        f"{'log J, largest':>16}"
    )
    for kind in filter(shifts.__contains__, CHANGES):
        d = np.array(shifts[kind])
        print(
            f"{kind:<22}{len(d):>6}{np.median(d):>11.1e}{d.max():>11.1e}"
            f"{int((d > 0.005).sum()):>11}{max(falls[kind]):>16.1e}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
