"""Rows of the contact bench with several grippers: place and layout of the formation.

One number per seed, arm and column, over the best five solutions. It is the median, except for
`surface` and `infeasible`:

- centre: horizontal distance of the mean gripper from its right place [cm];
- layout: RMS distance of the grippers from the ideal layout, turned about the vertical and
  shifted to fit best [cm]. The ideal is scaled with the object; where no scale is right (a
  triangle on a box), it is scaled to fit best;
- placed: RMS distance from the ideal layout at its right place, best over the object's symmetries
  [cm];
- surface: largest distance of the five solutions' grippers from the true surface, not the scan
  [mm];
- share: smallest part of the weight that a vertical cable carries, about the true centre of mass;
- infeasible: fraction of the solutions that are infeasible.

Equal grippers are interchangeable. Scans have 1 mm noise.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from itertools import permutations

import numpy as np
from scans import Z, box_mesh, box_query, box_scan, curved_mesh, mesh_points, placed

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.geometry import Pose, invert, quat_about_axis, rotate, transform
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn

COLUMNS = ("centre", "layout", "placed", "surface", "share", "infeasible")
NOISE = 0.001
# Limits for every row: distance of grippers from the surface [mm], fraction of infeasible
# solutions, fraction of seeds in which the formation is nearer its place than the control's.
SURFACE, INFEASIBLE, CLOSER = 3.0, 0.05, 0.8
_OVER_SEEDS = {"surface": np.max, "infeasible": np.mean}
TAUGHT = (0.68, 0.61, 0.28)
# Isosceles: a base of 40 cm, 36 cm high, its middle 10 cm off the box's.
IRREGULAR = np.array([[0.30, 0.08, 0.14], [-0.06, 0.28, 0.14], [-0.06, -0.12, 0.14]])


@dataclass
class FormationRow:
    """One line of the table; its results are keyed by arm, then by column."""

    name: str
    skill: Callable[[], ContactSkill]
    scan: Callable[[np.random.Generator], tuple[PointCloud, Pose]]
    mesh: Callable
    """A function that returns the true surface (trimesh), its centre of mass over the origin."""
    ideals: np.ndarray
    """Right gripper positions (K, n, 3) in the object's frame, one entry per symmetry [m]."""
    free_scale: bool = False
    """Whether the layout may be scaled before it is compared."""
    oriented: bool = True
    """Whether the ideals say which way the formation faces; if not, `placed` is left out."""
    levelled: bool = True
    """Whether the ideals include each gripper's height; if not, layouts are compared from above."""
    arms: tuple[str, ...] = ("task", "control", "paper", "kopicki", "centroid")
    limits: dict[str, float] = field(default_factory=dict)
    """What `task` should keep, by column: a most for the median over seeds, for `share` a least."""
    results: dict[str, dict[str, list[float]]] = field(default_factory=dict)

    def measure(self, seed: int, method: str, parameters: TransferParameters) -> dict[str, float]:
        """Return this seed's number in every column."""
        cloud, X_SB = self.scan(np.random.default_rng(seed))
        solutions = transfer(
            self.skill(), cloud, method=method, seed=seed, parameters=parameters
        ).solutions
        grippers = [transform(invert(X_SB), solution.X_SG.p) for solution in solutions]
        seen = np.array([1.0, 1.0, float(self.levelled)])
        columns = {
            "centre": [100.0 * centre_error(p, self.ideals) for p in grippers],
            "layout": [
                100.0 * layout_error(p * seen, self.ideals[0] * seen, self.free_scale)
                for p in grippers
            ],
            "placed": [100.0 * placed_error(p, self.ideals) for p in grippers],
            "surface": [1000.0 * surface_distance(p, self.mesh()) for p in grippers],
            "share": [smallest_share(p) for p in grippers],
        }
        if not self.oriented:
            del columns["placed"]
        values = {
            name: float((np.max if name == "surface" else np.median)(c))
            for name, c in columns.items()
        }
        return values | {
            "infeasible": float(np.mean([not solution.feasible for solution in solutions]))
        }

    def run(self, seeds: list[int], arms: tuple[str, ...], parameters: TransferParameters) -> None:
        """Measure and print the row, each arm as soon as it is known."""
        self.skill(), self.mesh()
        print(self.name)
        for arm in arms:
            start = time.process_time()
            numbers = [self.measure(seed, arm, parameters) for seed in seeds]
            seconds = (time.process_time() - start) / len(seeds)
            columns = self.results[arm] = {
                name: [values[name] for values in numbers] for name in numbers[0]
            }
            cells = [f"{name} {_cell(name, values)}" for name, values in columns.items()]
            print(f"    {arm:9s} {'  '.join(cells)}  ({seconds:.1f} CPU s)", flush=True)
        if "task" in self.results:
            print(f"    {'; '.join(self.verdicts())}", flush=True)

    def verdicts(self) -> list[str]:
        """Return what the task's arm was to keep, each with ok or MISS."""
        task = self.results["task"]
        lines = []
        for name, limit in {"surface": SURFACE, "infeasible": INFEASIBLE, **self.limits}.items():
            value = float(_OVER_SEEDS.get(name, np.median)(task[name]))
            kept = value >= limit if name == "share" else value <= limit
            lines.append(
                f"{name} {value:.2f} {'>=' if name == 'share' else '<='} {limit:g} {_verdict(kept)}"
            )
        if "control" in self.results:
            closer = np.array(task["centre"]) < np.array(self.results["control"]["centre"])
            lines.append(
                f"closer than control {closer.sum()}/{len(closer)} "
                f"{_verdict(closer.mean() >= CLOSER)}"
            )
        return lines


def _verdict(kept: bool) -> str:
    return "ok" if kept else "MISS"


def _cell(name: str, values: list[float]) -> str:
    if name == "infeasible":
        return f"{100.0 * np.mean(values):3.0f} %"
    digits = 2 if name == "share" else 1
    return f"{np.median(values):.{digits}f} [{min(values):.{digits}f} {max(values):.{digits}f}]"


def centre_error(p: np.ndarray, ideals: np.ndarray) -> float:
    """Return the horizontal distance [m] of grippers' mean from the nearest ideal one."""
    return float(np.linalg.norm((p.mean(axis=0) - ideals.mean(axis=1))[:, :2], axis=1).min())


def layout_error(p: np.ndarray, ideal: np.ndarray, free_scale: bool) -> float:
    """Return the RMS distance [m] of grippers p (n, 3) from the best fit of `ideal` (n, 3)."""
    offset = p - p.mean(axis=0)
    best = np.inf
    for order in permutations(range(len(p))):
        reference = (ideal - ideal.mean(axis=0))[list(order)]
        # As complex numbers, the best turn and factor are one division.
        a, b = reference[:, 0] + 1j * reference[:, 1], offset[:, 0] + 1j * offset[:, 1]
        fit = np.vdot(a, b) / np.vdot(a, a).real
        if not free_scale:
            fit = fit / max(abs(fit), 1e-12)
        level = (abs(fit) if free_scale else 1.0) * reference[:, 2]
        square = np.abs(b - fit * a) ** 2 + (offset[:, 2] - level) ** 2
        best = min(best, float(np.sqrt(square.mean())))
    return best


def placed_error(p: np.ndarray, ideals: np.ndarray) -> float:
    """Return the RMS distance [m] of grippers p (n, 3) from the nearest ideal layout, not moved."""
    return min(
        float(np.sqrt(np.mean(np.sum((p - ideal[list(order)]) ** 2, axis=1))))
        for ideal in ideals
        for order in permutations(range(len(p)))
    )


def surface_distance(p: np.ndarray, mesh) -> float:
    """Return the largest distance [m] of grippers p (n, 3) from a mesh."""
    import trimesh

    return float(trimesh.proximity.closest_point_naive(mesh, p)[1].max())


def smallest_share(p: np.ndarray) -> float:
    """Return the smallest part of the weight that a vertical cable at p (n, 3) carries.

    The centre of mass is over the origin. Two or three cables follow the lever rule; more cables
    share the weight as evenly as possible.
    """
    from scipy.optimize import linprog

    if len(p) == 2:
        a, b = p[:, :2]
        along = float((-a) @ (b - a) / ((b - a) @ (b - a)))
        return min(along, 1.0 - along)
    if len(p) == 3:
        return float(np.linalg.solve(np.vstack([p[:, :2].T, np.ones(3)]), [0.0, 0.0, 1.0]).min())
    n = len(p)
    # Unknowns: the shares, and a lower bound of all of them, which may be negative.
    best = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.hstack([-np.eye(n), np.ones((n, 1))]),
        b_ub=np.zeros(n),
        A_eq=np.column_stack([np.vstack([p[:, :2].T, np.ones(n)]), np.zeros(3)]),
        b_eq=[0.0, 0.0, 1.0],
        bounds=(None, None),
    )
    return float(best.x[-1])


@cache
def triangle_mesh(scale: float):
    mesh = curved_mesh("hollow_triangle").copy()
    mesh.apply_scale(scale)
    return mesh


@cache
def box(size: tuple[float, float, float]):
    return box_mesh(size)


def triangle_query(scale: float):
    """Return a function of a generator that scans a hollow triangle in full."""

    def scan(rng: np.random.Generator) -> tuple[PointCloud, Pose]:
        points = mesh_points(triangle_mesh(scale), rng)
        return placed(points + NOISE * rng.standard_normal(points.shape), rng, None)

    return scan


@cache
def formation_skill(name: str) -> ContactSkill:
    """Return the skill of a shipped demonstration, or of the `irregular` formation."""
    if name != "irregular":
        return learn(Demonstration.read(name))
    cloud = PointCloud.read(box_scan(TAUGHT, np.random.default_rng(12345)))
    return learn(Demonstration.make(cloud, IRREGULAR, name="irregular"))


def irregular_on(size: tuple[float, float, float]) -> np.ndarray:
    """Return the irregular layouts (K, 3, 3) on a box, one for each turn of the box onto itself.

    The centre moves in proportion to the sides; the layout is scaled by their mean ratio.
    """
    ratio = np.array(size) / np.array(TAUGHT)
    centre = IRREGULAR.mean(axis=0)
    layout = (IRREGULAR - centre) * np.sqrt(ratio[0] * ratio[1])
    turns = range(4) if size[0] == size[1] else (0, 2)
    return np.array(
        [
            rotate(quat_about_axis(Z, np.asarray(0.5 * np.pi * k)), layout + centre * ratio)
            for k in turns
        ]
    )


def formation_rows() -> list[FormationRow]:
    """Return all rows."""
    triangle = Demonstration.read("formation").grippers.p
    bar = Demonstration.read("bar").grippers.p
    table = [
        FormationRow(
            f"triangle to {scale:g}x",
            lambda: formation_skill("formation"),
            triangle_query(scale),
            lambda scale=scale: triangle_mesh(scale),
            scale * triangle[None],
            limits={"centre": 0.8, "layout": 1.5},
        )
        for scale in (1.0, 0.7, 1.4)
    ]
    square, large = (0.68, 0.68, 0.28), (1.0, 0.8, 0.3)
    for size, limit in ((square, 2.0), (large, 2.5)):
        label = "x".join(f"{100 * s:.0f}" for s in size)
        table.append(
            FormationRow(
                f"triangle to box {label}",
                lambda: formation_skill("formation"),
                box_query(size, noise=NOISE),
                lambda size=size: box(size),
                (triangle - triangle.mean(axis=0) + [0.0, 0.0, 0.5 * size[2]])[None],
                free_scale=True,
                oriented=False,
                limits={"centre": limit, "share": 0.28},
            )
        )
    for size in (square, large):
        label = "x".join(f"{100 * s:.0f}" for s in size)
        table.append(
            FormationRow(
                f"irregular to box {label}",
                lambda: formation_skill("irregular"),
                box_query(size, noise=NOISE),
                lambda size=size: box(size),
                irregular_on(size),
                free_scale=True,
            )
        )
    long = (1.4, 0.1, 0.06)
    table.append(
        FormationRow(
            "bar to bar of 140 cm",
            lambda: formation_skill("bar"),
            box_query(long, noise=NOISE),
            lambda: box(long),
            (bar * [1.4, 1.0, 1.0])[None],
        )
    )
    return table
