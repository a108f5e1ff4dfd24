"""Hard rows of the contact bench: several levels, partial scans, two to six grippers.

The columns are those of formation_rows.py. On an object of another size, the centre of the
demonstrated layout moves in proportion, the layout is scaled by the sides' mean ratio, and every
gripper stands on the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from formation_rows import (
    NOISE,
    TAUGHT,
    FormationRow,
    box,
    formation_skill,
    irregular_on,
    triangle_mesh,
)
from scans import Z, box_query, camera_query, mesh_points, mesh_query, terrace_mesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.geometry import quat_about_axis, rotate
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn

ARMS = ("task", "control", "centroid")
Size = tuple[float, float, float]
# Grippers seen from above, as parts of the object's sides from its outline's middle.
ON_STEP = np.array([[0.30, 0.03], [-0.28, 0.33], [-0.28, -0.33]])
ON_TOWER = np.array([[0.40, 0.0], [-0.30, 0.36], [-0.30, -0.36], [0.0, 0.0]])
TWO = np.array([[0.36, 0.10], [-0.30, 0.10]])
FOUR = np.array([[0.36, 0.34], [-0.36, 0.34], [-0.36, -0.34], [0.36, -0.34]])
SIX = np.column_stack(
    [0.40 * np.cos(np.arange(6) * np.pi / 3.0), 0.42 * np.sin(np.arange(6) * np.pi / 3.0)]
)


@cache
def step(size: Size, raised: float):
    """Return a box of which the half at positive x is `raised` metres higher."""
    a, b, h = size
    return terrace_mesh((-0.5 * a, 0.0, 0.5 * a), (-0.5 * b, 0.5 * b), [[h], [h + raised]])


@cache
def tower(size: Size, raised: float):
    """Return a box with a quarter of each side, in its middle, `raised` metres higher."""
    a, b, h = size
    level = np.full((3, 3), h)
    level[1, 1] += raised
    return terrace_mesh(*((-0.5 * s, -0.125 * s, 0.125 * s, 0.5 * s) for s in (a, b)), level)


def on_top(mesh, xy: np.ndarray) -> np.ndarray:
    """Return the topmost points (M, 3) of a mesh at horizontal positions (M, 2) [m]."""
    a, b, c = (mesh.triangles[:, k, :2] for k in range(3))
    T = np.stack([a - c, b - c], axis=-1)
    flat = np.abs(np.linalg.det(T)) > 1e-9
    heights = []
    for at in xy:
        uv = np.linalg.solve(T[flat], (at - c[flat])[..., None])[..., 0]
        w = np.column_stack([uv, 1.0 - uv.sum(axis=1)])
        hit = np.all(w >= -1e-9, axis=1)
        heights.append(np.sum(w[hit] * mesh.triangles[flat][hit][:, :, 2], axis=1).max())
    return np.column_stack([xy, heights])


def places(
    mesh, taught: Size, size: Size, parts: np.ndarray, turns: tuple[int, ...] = (0,)
) -> np.ndarray:
    """Return the right gripper positions (K, n, 3) on a mesh of sides `size`.

    There is one entry for each of `turns`, the quarter turns of the mesh onto itself.
    """
    middle = 0.5 * (mesh.bounds[0] + mesh.bounds[1])[:2]
    ratio = np.array(size[:2]) / np.array(taught[:2])
    p = parts * np.array(taught[:2])
    centre = p.mean(axis=0)
    layout = (p - centre) * np.sqrt(ratio[0] * ratio[1]) + centre * ratio
    level = np.column_stack([layout, np.zeros(len(p))])
    turned = [rotate(quat_about_axis(Z, np.asarray(0.5 * np.pi * k)), level)[:, :2] for k in turns]
    return np.array([on_top(mesh, xy + middle) for xy in turned])


@cache
def mesh_skill(mesh_of: Callable, taught: tuple, parts: tuple) -> ContactSkill:
    """Return the skill of grippers at `parts` of `mesh_of(*taught)`; `taught[0]` is its size."""
    mesh = mesh_of(*taught)
    cloud = PointCloud.read(mesh_points(mesh, np.random.default_rng(12345)))
    p = places(mesh, taught[0], taught[0], np.array(parts))[0]
    return learn(Demonstration.make(cloud, p, name=mesh_of.__name__))


def _own(
    name: str, mesh_of: Callable, taught: tuple, asked: tuple, parts: np.ndarray, turns=(0,)
) -> FormationRow:
    """Return the row of a formation taught on one object of a kind and asked on another."""
    frozen = tuple(map(tuple, parts))
    return FormationRow(
        name,
        lambda: mesh_skill(mesh_of, taught, frozen),
        mesh_query(lambda: mesh_of(*asked)),
        lambda: mesh_of(*asked),
        places(mesh_of(*asked), taught[0], asked[0], parts, turns),
        free_scale=True,
        arms=ARMS,
    )


def hard_formation_rows() -> list[FormationRow]:
    """Return all rows."""
    square, large, low = (0.68, 0.68, 0.28), (1.0, 0.8, 0.3), (0.68, 0.61, 0.2)
    wide = (0.9, 0.8, 0.2)
    triangle = Demonstration.read("formation").grippers.p
    table = []
    for raised in (0.08, 0.2):
        mesh = step(square, raised)
        middle = 0.5 * (mesh.bounds[0] + mesh.bounds[1])[:2]
        ideal = on_top(mesh, triangle[:, :2] - triangle[:, :2].mean(axis=0) + middle)
        table.append(
            FormationRow(
                f"levels: triangle to a step of {100 * raised:.0f} cm",
                lambda: formation_skill("formation"),
                mesh_query(lambda raised=raised: step(square, raised)),
                lambda raised=raised: step(square, raised),
                ideal[None],
                free_scale=True,
                oriented=False,
                levelled=False,
                arms=ARMS,
            )
        )
    table += [
        _own("levels: step to 68x61, +10", step, (low, 0.1), (low, 0.1), ON_STEP),
        _own("levels: step to 68x61, +20", step, (low, 0.1), (low, 0.2), ON_STEP),
        _own("levels: step to 100x80, +15", step, (low, 0.1), ((1.0, 0.8, 0.25), 0.15), ON_STEP),
        _own("levels: tower to 90x80, +25", tower, (wide, 0.25), (wide, 0.25), ON_TOWER, (0, 2)),
        _own("levels: tower to 90x80, +10", tower, (wide, 0.25), (wide, 0.1), ON_TOWER, (0, 2)),
        _own(
            "levels: tower to 120x100, +35",
            tower,
            (wide, 0.25),
            ((1.2, 1.0, 0.25), 0.35),
            ON_TOWER,
            (0, 2),
        ),
        _own("team: two, off-centre, to 100x80", _box, (TAUGHT,), (large,), TWO, (0, 2)),
        _own("team: four to 100x80", _box, (TAUGHT,), (large,), FOUR, (0, 2)),
        _own("team: six to 140x100", _box, ((1.1, 0.9, 0.3),), ((1.4, 1.0, 0.3),), SIX, (0, 2)),
    ]
    for name, scan in (
        ("one camera", camera_query(lambda: box(square))),
        ("missing strip", box_query(square, noise=NOISE, cut="strip")),
        ("missing corner", box_query(square, noise=NOISE, cut="corner")),
        ("top view", box_query(square, "top", NOISE)),
    ):
        irregular = irregular_on(square)
        table.append(
            FormationRow(
                f"partial: irregular to 68x68, {name}",
                lambda: formation_skill("irregular"),
                scan,
                lambda: box(square),
                irregular,
                free_scale=True,
                arms=ARMS,
            )
        )
    for name, scan in (
        ("one camera", camera_query(lambda: triangle_mesh(1.0))),
        ("missing corner", mesh_query(lambda: triangle_mesh(1.0), cut="strip")),
    ):
        table.append(
            FormationRow(
                f"partial: triangle, {name}",
                lambda: formation_skill("formation"),
                scan,
                lambda: triangle_mesh(1.0),
                triangle[None],
                arms=ARMS,
            )
        )
    return table


def _box(size: Size):
    return box(size)
