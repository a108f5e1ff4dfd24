"""Table of transferred contacts: distance from the right place, by method and object.

    python tools/bench/contacts.py [--rows ROW ...] [--seeds 100-109] [--scale auto]
                                   [--json FILE] [--pictures DIR]

One number per seed and arm: the distance from the right place [cm], as median over the best five
solutions. A seed draws the scan (surface samples, noise, yaw, place) and the transfer. Arms:
`task`, its matched control (`control`: no votes, everything else equal), `paper`, `kopicki`,
`centroid`. The defaults were chosen on seeds 0 to 9; the table uses seeds 100 to 109, which were
not used for that. Rows with several grippers have other columns: see formation_rows.py.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from formation_rows import FormationRow, formation_rows
from hard_formation_rows import hard_formation_rows
from scans import (
    above_centroid,
    box_mesh,
    box_query,
    box_scan,
    camera_query,
    curved_mesh,
    curved_query,
    mesh_points,
)

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.geometry import Pose, invert, transform
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn

ARMS = ("task", "control", "paper", "kopicki", "registration", "obb", "centroid")
TAUGHT = (0.68, 0.61, 0.28)


@cache
def box_skill(site: tuple[float, float] = (0.0, 0.0), view: str = "full") -> ContactSkill:
    """Return the skill of one gripper on the taught box's top, `site` metres off its centre."""
    points = box_scan(TAUGHT, np.random.default_rng(12345), view)
    cloud = PointCloud.read(points, viewpoint=(0.0, 0.0, 3.0) if view == "top" else None)
    position = [[site[0], site[1], 0.5 * TAUGHT[2]]]
    return learn(Demonstration.make(cloud, position, name=f"box {site} {view}"))


def sites_by_ratio(site: tuple[float, float], size: tuple[float, float, float]) -> np.ndarray:
    """Return the places (M, 3) on a box that correspond to `site`, with mirror images [m]."""
    ratio = np.array(site) / np.array(TAUGHT[:2])
    layouts = [ratio]
    if size[0] == size[1]:
        # A square looks the same after a quarter turn.
        layouts.append(ratio[::-1])
    signs = np.array([[a, b] for a in (-1, 1) for b in (-1, 1)])
    places = np.vstack([signs * layout * np.array(size[:2]) for layout in layouts])
    return np.column_stack([places, np.full(len(places), 0.5 * size[2])])


@dataclass
class Row:
    """One line of the table."""

    name: str
    skill: Callable[[], ContactSkill]
    scan: Callable[[np.random.Generator], tuple[PointCloud, Pose]]
    sites: np.ndarray
    """Right places (M, 3) in the object's frame [m]; the nearest counts."""
    horizontal: bool = False
    """Whether only the horizontal distance counts."""
    arms: tuple[str, ...] = ARMS
    scales: tuple[str, ...] = ()
    """Scale modes to compare, each an arm of its own."""
    target: str = ""
    limit: float | None = None
    """Distance within which a seed counts as a success [cm]."""
    results: dict[str, list[float]] = field(default_factory=dict)


@cache
def curved_skill(name: str) -> ContactSkill:
    """Return the skill of one gripper above the volume centroid of a curved object."""
    mesh = curved_mesh(name)
    cloud = PointCloud.read(mesh_points(mesh, np.random.default_rng(12345)))
    at = above_centroid(mesh)
    nearest = mesh.triangles_center - at
    normal = mesh.face_normals[np.argmin(np.linalg.norm(nearest, axis=1))]
    return learn(Demonstration.make(cloud, at, axes=normal[None], name=name))


@cache
def shipped_skill(name: str) -> ContactSkill:
    """Return the skill of a shipped demonstration."""
    return learn(Demonstration.read(name))


def top_centre(size: tuple[float, float, float]) -> np.ndarray:
    return np.array([[0.0, 0.0, 0.5 * size[2]]])


def rows() -> list[Row]:
    """Return all rows."""
    square, small, large, long = (
        (0.68, 0.68, 0.28),
        (0.45, 0.35, 0.25),
        (1.0, 0.8, 0.3),
        (0.9, 0.45, 0.25),
    )
    table = [
        Row(
            "68x68x28",
            box_skill,
            box_query(square),
            top_centre(square),
            target="1.2 (2.5); paper 5",
        ),
        Row("45x35x25", box_skill, box_query(small), top_centre(small), target="1.2"),
        Row("100x80x30", box_skill, box_query(large), top_centre(large), target="1.5"),
        Row("90x45x25", box_skill, box_query(long), top_centre(long), target="1.5"),
        Row(
            "top view, 1 mm noise",
            lambda: box_skill(view="top"),
            box_query(square, "top", 0.001),
            top_centre(square),
            target="1.5",
        ),
        Row(
            "taught top, asked full",
            lambda: box_skill(view="top"),
            box_query(square),
            top_centre(square),
            target="1.5",
        ),
        Row(
            "taught full, asked top",
            box_skill,
            box_query(square, "top"),
            top_centre(square),
            target="1.5",
        ),
        Row(
            "5 mm noise",
            box_skill,
            box_query(square, noise=0.005),
            top_centre(square),
            target="2.0",
        ),
    ]
    table += [
        Row(
            f"one camera, {name}",
            lambda: shipped_skill("flat"),
            camera_query(lambda size=size: box_mesh(size)),
            top_centre(size),
        )
        for name, size in (("68x68", square), ("45x35", small))
    ]
    off = {"edge": (0.29, 0.0), "15 cm along": (0.15, 0.0), "corner": (0.21, 0.18)}
    for name, site in off.items():
        for size in (square, large):
            label = "x".join(f"{100 * s:.0f}" for s in size[:2])
            table.append(
                Row(
                    f"{name}, {label}",
                    lambda site=site: box_skill(site),
                    box_query(size),
                    sites_by_ratio(site, size),
                    target=">= 80 % within 2.5",
                    limit=2.5,
                )
            )
    for taught, asked in (("teapot", "bunny"), ("bunny", "teapot"), ("ellipsoid", "bunny")):
        table.append(
            Row(
                f"{taught} to {asked}",
                lambda taught=taught: curved_skill(taught),
                curved_query(asked),
                curved_mesh(asked).center_mass[None],
                horizontal=True,
                target="task closer than control >= 9/10",
            )
        )
    table.append(
        Row(
            "curved to bunny, one camera",
            lambda: shipped_skill("curved"),
            camera_query(lambda: curved_mesh("bunny")),
            curved_mesh("bunny").center_mass[None],
            horizontal=True,
        )
    )
    for cut in ("strip", "corner"):
        for view in ("full", "top"):
            table.append(
                Row(
                    f"missing {cut}, {view}",
                    box_skill,
                    box_query(square, view, 0.001, cut),
                    top_centre(square),
                    arms=(),
                    scales=("auto", "support", "area", "rigid"),
                )
            )
    table.append(
        Row(
            "missing strip, 90x45",
            box_skill,
            box_query(long, "full", 0.001, "strip"),
            top_centre(long),
            arms=(),
            scales=("auto", "support", "area", "rigid"),
        )
    )
    return table


def measure(row: Row, seed: int, method: str, scale: str) -> float:
    """Return the median distance of the best five solutions from the right place [cm]."""
    cloud, X_SB = row.scan(np.random.default_rng(seed))
    parameters = TransferParameters(scale=scale)
    solutions = transfer(row.skill(), cloud, method=method, seed=seed, parameters=parameters)
    right = transform(X_SB, row.sites)
    distances = []
    for solution in solutions.solutions:
        gap = solution.X_SG.p.mean(axis=0) - right
        distances.append(
            100.0 * np.linalg.norm(gap[:, :2] if row.horizontal else gap, axis=1).min()
        )
    return float(np.median(distances))


def draw(row: Row, seeds: list[int], scale: str, folder: Path) -> None:
    """Draw the best contact of every seed, from above and from the side, and the demonstration."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    skill = row.skill()
    figure, axes = plt.subplots(2, 3, figsize=(12, 7))
    clouds = [skill.points, None, None]
    contacts = [skill.X_NG.p, [], []]
    for seed in seeds:
        cloud, X_SB = row.scan(np.random.default_rng(seed))
        for k, arm in ((1, "task"), (2, "control")):
            found = transfer(
                skill, cloud, method=arm, seed=seed, parameters=TransferParameters(scale=scale)
            )
            contacts[k].append(transform(invert(X_SB), found[0].X_SG.p.mean(axis=0)))
        clouds[1] = clouds[2] = transform(invert(X_SB), cloud.points)
    for k, title in enumerate(
        ("demonstration", f"task, best of {len(seeds)} seeds each", "control: no votes")
    ):
        p, c = clouds[k][:: max(len(clouds[k]) // 4000, 1)], np.array(contacts[k])
        for line, (i, j) in enumerate(((0, 1), (0, 2))):
            ax = axes[line, k]
            ax.scatter(p[:, i], p[:, j], s=1, c=p[:, 2], cmap="Greys_r", alpha=0.5)
            ax.scatter(c[:, i], c[:, j], s=30, c="tab:red", edgecolor="white", zorder=3)
            if k:
                ax.axvline(row.sites[0, i], lw=0.7)
                if line == 0:
                    ax.axhline(row.sites[0, j], lw=0.7)
            ax.set_aspect("equal")
            ax.set_title(f"{title} ({'from above' if line == 0 else 'from the side'})", fontsize=9)
            ax.set_xlabel("m")
    figure.suptitle(f"{row.name}; lines: the right place")
    figure.tight_layout()
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{row.name.replace(' ', '_').replace(',', '')}.png", dpi=90)
    plt.close(figure)


def summary(values: list[float]) -> str:
    return f"{np.median(values):5.1f} [{min(values):4.1f} {max(values):5.1f}]"


def run(table: list[Row | FormationRow], seeds: list[int], scale: str) -> None:
    """Fill and print the rows, one at a time."""
    print(
        "cm, median [min max] over",
        len(seeds),
        "seeds; one number per seed: the median of its best five",
    )
    for row in table:
        if isinstance(row, FormationRow):
            row.run(seeds, row.arms, TransferParameters(scale=scale))
            continue
        arms = [(arm, arm, scale) for arm in row.arms] + [
            (mode, "task", mode) for mode in row.scales
        ]
        start = time.perf_counter()
        for name, method, mode in arms:
            row.results[name] = [measure(row, seed, method, mode) for seed in seeds]
        seconds = (time.perf_counter() - start) / max(len(arms) * len(seeds), 1)
        cells = "  ".join(f"{name} {summary(values)}" for name, values in row.results.items())
        notes = []
        if {"task", "control"} <= set(row.results):
            closer = np.sum(np.array(row.results["task"]) < np.array(row.results["control"]))
            notes.append(f"task closer than control {closer}/{len(seeds)}")
        if row.limit is not None:
            within = {
                name: sum(v <= row.limit for v in values) for name, values in row.results.items()
            }
            notes.append(
                f"within {row.limit} cm: " + " ".join(f"{k} {v}" for k, v in within.items())
            )
        if row.target:
            notes.append(f"target {row.target}")
        print(
            f"{row.name:24s} {cells}\n{'':24s} {'; '.join(notes)} ({seconds:.1f} s per transfer)",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    table: list[Row | FormationRow] = [*rows(), *formation_rows(), *hard_formation_rows()]
    parser.add_argument("--rows", nargs="+", help="parts of row names; all by default")
    parser.add_argument("--seeds", default="100-109", help="first-last, both included")
    parser.add_argument("--arms", nargs="+", choices=ARMS, help="arms to run; all by default")
    parser.add_argument(
        "--scale", default="auto", help="scale mode of the votes outside the cut scans"
    )
    parser.add_argument("--json", help="write every number to this file")
    parser.add_argument(
        "--pictures", help="draw the rows' best contacts into this folder instead of measuring"
    )
    parser.add_argument("--list", action="store_true", help="print the rows' names")
    options = parser.parse_args()
    if options.list:
        print("\n".join(row.name for row in table))
        return 0
    if options.rows:
        table = [row for row in table if any(part in row.name for part in options.rows)]
    if options.arms:
        for row in table:
            row.arms = tuple(arm for arm in row.arms if arm in options.arms)
    first, last = (int(part) for part in options.seeds.split("-"))
    seeds = list(range(first, last + 1))
    if options.pictures:
        for row in (row for row in table if isinstance(row, Row)):
            draw(row, seeds, options.scale, Path(options.pictures))
        return 0
    run(table, seeds, options.scale)
    if options.json:
        with open(options.json, "w") as file:
            json.dump({row.name: row.results for row in table}, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
