"""Refinement of annealed solutions, and of solutions that were made infeasible.

    python tools/bench/refinement.py [--rows ROW ...] [--seeds 100-104] [--repeats 2]
                                     [--solver snopt] [--json FILE]

For every row and seed, the best five solutions of `transfer` are refined (gain in log J, number
of solutions that fell, seconds). Then each feasible solution is disturbed so that it is
infeasible while a feasible one is at most 5 cm away:

    off      every gripper 1.5 to 5 cm off the surface, outwards or inwards
    tilted   every gripper 20 to 80 degrees off its normal
    moved    every gripper up to 5 cm in any direction, and turned by about 30 degrees
    crowded  grippers moved together by up to 5 cm (several grippers)
    pulled   the formation moved out of equilibrium, up to 3 cm beyond (several grippers)
    astray   one gripper in an infeasible place (upside down, say), a feasible one within 5 cm

Seconds are wall-clock and CPU seconds per solution, one thread.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from contacts import box_skill, curved_skill
from scans import box_query, box_scan, curved_mesh, curved_query, mesh_points

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.contact_checker import ContactChecker
from drake_aerial.contacts.feasibility.reasons import ReasonKind
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.refinement.refine import refine
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.contacts.transfer import transfer
from drake_aerial.geometry import (
    Array,
    Pose,
    axis_of,
    cross,
    invert,
    perpendicular,
    quat_exp,
    quat_multiply,
)
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn

UNBALANCED = (ReasonKind.ONE_SIDED, ReasonKind.UNBALANCED)
BAR = (1.0, 0.12, 0.08)
TABLE = (1.1, 0.9, 0.3)
TRIANGLE = ((-0.21, -0.364, 0.0), (0.42, 0.0, 0.0), (-0.21, 0.364, 0.0))


@cache
def formation_skill(kind: str) -> ContactSkill:
    """Return a skill: two grippers on a bar, three on the hollow triangle, or six on a box."""
    rng = np.random.default_rng(12345)
    if kind == "hexagon":
        angle = np.arange(6) * np.pi / 3.0
        corners = np.stack(
            [0.38 * np.cos(angle), 0.38 * np.sin(angle), np.full(6, 0.5 * TABLE[2])], axis=1
        )
        return learn(Demonstration.make(PointCloud.read(box_scan(TABLE, rng)), corners, name=kind))
    if kind == "bar":
        cloud = PointCloud.read(box_scan(BAR, rng))
        return learn(Demonstration.make(cloud, [[-0.35, 0.0, 0.04], [0.35, 0.0, 0.04]], name=kind))
    mesh = curved_mesh("hollow_triangle")
    corners = 0.85 * np.array(TRIANGLE) + [*mesh.center_mass[:2], mesh.bounds[1, 2]]
    points = mesh_points(mesh, rng)
    nearest = [points[np.argmin(np.linalg.norm(points - corner, axis=1))] for corner in corners]
    return learn(Demonstration.make(PointCloud.read(points), nearest, name=kind))


@dataclass
class Row:
    """One object to transfer to, and what was counted on it."""

    name: str
    skill: Callable[[], ContactSkill]
    scan: Callable[[np.random.Generator], tuple[PointCloud, Pose]]
    gain: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    rescued: dict[str, list[bool]] = field(default_factory=dict)
    rescue_cpu: list[float] = field(default_factory=list)
    left: list[str] = field(default_factory=list)


def rows() -> list[Row]:
    """Return all rows."""
    square, large = (0.68, 0.68, 0.28), (1.0, 0.8, 0.3)
    return [
        Row("one, 68x68", box_skill, box_query(square)),
        Row("one, top view, 1 mm", lambda: box_skill(view="top"), box_query(square, "top", 0.001)),
        Row("one, 5 mm noise", box_skill, box_query(square, noise=0.005)),
        Row("edge, 100x80", lambda: box_skill((0.29, 0.0)), box_query(large)),
        Row("teapot to bunny", lambda: curved_skill("teapot"), curved_query("bunny")),
        Row("bunny to teapot", lambda: curved_skill("bunny"), curved_query("teapot")),
        Row("two, bar", lambda: formation_skill("bar"), box_query(BAR)),
        Row("two, bar 70x10", lambda: formation_skill("bar"), box_query((0.7, 0.1, 0.1))),
        Row(
            "three, triangle", lambda: formation_skill("triangle"), curved_query("hollow_triangle")
        ),
        Row("three, 68x68", lambda: formation_skill("triangle"), box_query(square)),
        Row("three, 100x80", lambda: formation_skill("triangle"), box_query(large)),
        Row("six, 120x100", lambda: formation_skill("hexagon"), box_query((1.2, 1.0, 0.3))),
    ]


def off(X: Pose, rng: np.random.Generator) -> Pose:
    """Return grippers off the surface."""
    d = rng.uniform(0.015, 0.05, (len(X.p), 1)) * rng.choice([-1.0, 1.0], (len(X.p), 1))
    return Pose(X.p + d * axis_of(X.q, 2), X.q)


def tilted(X: Pose, rng: np.random.Generator) -> Pose:
    """Return grippers that lean."""
    z, angle = axis_of(X.q, 2), rng.uniform(-np.pi, np.pi, (len(X.p), 1))
    e = perpendicular(z)
    about = np.cos(angle) * e + np.sin(angle) * cross(z, e)
    return Pose(
        X.p, quat_multiply(quat_exp(np.deg2rad(rng.uniform(20.0, 80.0, angle.shape)) * about), X.q)
    )


def moved(X: Pose, rng: np.random.Generator) -> Pose:
    """Return grippers moved and turned at random."""
    d = rng.standard_normal(X.p.shape)
    d *= rng.uniform(0.01, 0.05, (len(d), 1)) / np.linalg.norm(d, axis=1, keepdims=True)
    return Pose(X.p + d, quat_multiply(quat_exp(0.3 * rng.standard_normal(X.p.shape)), X.q))


def crowded(X: Pose, rng: np.random.Generator) -> Pose:
    """Return grippers drawn together."""
    d = X.p.mean(axis=0) - X.p
    return Pose(X.p + rng.uniform(0.03, 0.05) * d / np.linalg.norm(d, axis=1, keepdims=True), X.q)


def pulled(X: Pose, rng: np.random.Generator, checker: ContactChecker) -> Pose | None:
    """Return the formation moved along the surface out of equilibrium; shrink it if necessary."""
    for size in (1.0, 0.8, 0.65, 0.5, 0.4):
        angle = rng.uniform(-np.pi, np.pi)
        d = np.array([np.cos(angle), np.sin(angle), 0.0])
        if len(X.p) == 2:
            d = (X.p[1] - X.p[0]) / np.linalg.norm(X.p[1] - X.p[0]) * rng.choice([-1.0, 1.0])
        middle = X.p.mean(axis=0)
        for distance in np.arange(0.01, 0.4, 0.01):
            pushed, _, _ = checker.surface.set_down(
                Pose(middle + size * (X.p - middle) + distance * d, X.q)
            )
            reasons = checker.reasons(pushed)
            if reasons:
                break
            balanced = pushed
        # Only if the step before was feasible and nothing but the equilibrium was lost.
        if distance > 0.015 and len(reasons) == 1 and reasons[0].kind in UNBALANCED:
            return Pose(balanced.p + rng.uniform(0.015, 0.04) * d, balanced.q)
    return None


def astray(rng: np.random.Generator, checker: ContactChecker) -> Pose | None:
    """Return one gripper on an infeasible feature that has a feasible one within 5 cm."""
    features = checker.query.scan.features.pose
    for i in rng.permutation(len(features.p))[:300]:
        X = features.take([i])
        if not checker.reasons(X):
            continue
        near = np.flatnonzero(np.linalg.norm(features.p - X.p[0], axis=1) < 0.05)
        if any(not checker.reasons(features.take([j])) for j in near):
            return X
    return None


def refined(
    skill: ContactSkill, solutions: ContactSolutions, seed: Solution, solver: str
) -> Solution:
    """Return the refinement of one seed."""
    alone = replace(solutions, solutions=(seed,))
    return refine(skill, alone, solver=solver, merge=False)[0]


def measure(row: Row, seed: int, repeats: int, solver: str) -> None:
    """Add one seed's counts to the row."""
    rng = np.random.default_rng(seed)
    cloud, _ = row.scan(rng)
    skill = row.skill()
    solutions = transfer(skill, cloud, seed=seed)
    query = solutions.query
    assert query is not None
    wall, cpu = time.perf_counter(), time.process_time()
    refine(skill, solutions, solver=solver, merge=False)
    row.wall.append((time.perf_counter() - wall) / len(solutions))
    row.cpu.append((time.process_time() - cpu) / len(solutions))
    for seed_ in solutions.solutions:
        # Each seed beside its own refinement.
        own = refined(skill, solutions, seed_, solver)
        if seed_.feasible:
            row.gain.append(own.log_likelihood - seed_.log_likelihood if own.feasible else -np.inf)
        else:
            row.rescued.setdefault("annealed", []).append(own.feasible)
            row.left += [f"annealed: {[*map(str, seed_.reasons)]} -> {[*map(str, own.reasons)]}"]

    checker = ContactChecker(query, TransferParameters())
    X_NS = invert(query.scan.X_SN)
    for solution in solutions.solutions * repeats:
        X = X_NS @ solution.X_SG
        if checker.reasons(X):
            continue
        kinds: dict[str, Pose | None] = {
            "off": off(X, rng),
            "tilted": tilted(X, rng),
            "moved": moved(X, rng),
        }
        if len(skill) > 1:
            kinds |= {"crowded": crowded(X, rng), "pulled": pulled(X, rng, checker)}
        else:
            kinds["astray"] = astray(rng, checker)
        for name, pose in kinds.items():
            if pose is None or not checker.reasons(pose):
                continue
            begin = time.process_time()
            found = refined(skill, solutions, checker.solution(pose), solver)
            row.rescue_cpu.append(time.process_time() - begin)
            row.rescued.setdefault(name, []).append(found.feasible)
            row.left += [f"{name}: {reason}" for reason in found.reasons]


def line(row: Row) -> str:
    """Return the row's counts as text."""

    def seconds(values: list[float]) -> str:
        a: Array = np.array(values)
        return f"{np.median(a):.2f} (max {a.max():.2f})" if len(a) else "-"

    gain = np.array(row.gain)
    counts = "  ".join(f"{name} {sum(found)}/{len(found)}" for name, found in row.rescued.items())
    gains = (
        f"gain {np.median(gain):.3f} [{gain.min():.4f} {gain.max():.3f}], falls {np.sum(gain < 0)}"
        if len(gain)
        else ""
    )
    return (
        f"{row.name:20s} {gains}; "
        f"per solution {seconds(row.wall)} s wall, {seconds(row.cpu)} s CPU\n"
        f"{'':20s} made feasible: {counts}; {seconds(row.rescue_cpu)} s CPU"
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", nargs="+", help="parts of row names; all by default")
    parser.add_argument("--seeds", default="100-104", help="first-last, both included")
    parser.add_argument(
        "--repeats", type=int, default=2, help="disturbances of each kind per solution"
    )
    parser.add_argument("--solver", default="snopt", help="snopt, ipopt or nlopt")
    parser.add_argument("--reasons", action="store_true", help="print what is left of the reasons")
    parser.add_argument("--json", help="write every number to this file")
    options = parser.parse_args()
    table = [
        row for row in rows() if not options.rows or any(part in row.name for part in options.rows)
    ]
    first, last = (int(part) for part in options.seeds.split("-"))
    for row in table:
        for seed in range(first, last + 1):
            measure(row, seed, options.repeats, options.solver)
        print(line(row), flush=True)
        if options.reasons:
            for reason in row.left:
                print(f"{'':20s}   {reason}")
    if options.json:
        counts = {
            row.name: {"gain": row.gain, "wall": row.wall, "cpu": row.cpu, "rescued": row.rescued}
            for row in table
        }
        with open(options.json, "w") as file:
            json.dump(counts, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
