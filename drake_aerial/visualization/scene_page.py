"""A page of a scene: the image with its objects, the cloud in space, contacts and gravity."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.boundary import BoundaryKind
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.geometry import Array
from drake_aerial.scene.scene import FIRST_OBJECT, NOTHING, SUPPORT, Scene
from drake_aerial.visualization.colors import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Color,
    solution_color,
)
from drake_aerial.visualization.html_report import write_html_report

# Colours that differ for the eye, also with a colour deficiency; objects take them in turn.
_OBJECT_COLORS: tuple[Color, ...] = (
    (0.90, 0.62, 0.00),
    (0.34, 0.71, 0.91),
    (0.80, 0.47, 0.65),
    (0.94, 0.89, 0.26),
    (0.60, 0.40, 0.80),
    (0.45, 0.80, 0.70),
    (0.84, 0.37, 0.00),
)
_SUPPORT_COLOR: Color = (0.78, 0.81, 0.85)
BOUNDARY_COLORS: dict[BoundaryKind, Color] = {
    BoundaryKind.SEEN: GREEN,
    BoundaryKind.OCCLUDED: RED,
    BoundaryKind.CUT: BLUE,
}
_MOST_POINTS, _MOST_OF_OBJECTS = 40_000, 25_000
# Owners from this number on are drawings, not points of the scan.
_DRAWN = 250


def write_scene_page(
    path: str | Path, scene: Scene, solutions: ContactSolutions | None = None
) -> None:
    """Write a scene as one HTML file: an image and a cloud, in which objects can be clicked.

    Parameters
    ----------
    path : str or Path
        The page; it appears when it is complete.
    scene : Scene
    solutions : ContactSolutions, optional
        Contacts on one of the objects, to be drawn into the whole scene.
    """
    cloud = scene.cloud
    name = Path(cloud.path).name if cloud.path else "(from memory)"
    gravity = scene.gravity
    up = " ".join(f"{x:+.3f}" for x in gravity.up)
    height, width = scene.image.shape
    record = None if solutions is None else solutions.cloud.get("object")
    values = {
        "title": f"scene {name}",
        "width": width,
        "height": height,
        "gravity": f"Up is {up}, {_source(str(gravity.source))}, "
        f"uncertainty {gravity.uncertainty_deg:.2f} deg. {len(scene.supports)} support(s), "
        f"{len(scene.objects)} object(s).",
        "warning": gravity.warning,
        "image_caption": "Depth (near is dark) with the objects in colour."
        if scene.image.camera is not None
        else "The cloud as an image, with the objects in colour.",
        "legend": _legend(solutions),
        "objects": [_row(found) for found in scene.objects],
        "notes": _notes(solutions),
        "data": _data(scene, solutions, 0 if record is None else int(record["number"])),
    }
    write_html_report(path, "scene_page.html", values)


def _source(source: str) -> str:
    sources = {"given": "as given", "imu": "by the IMU", "support": "from the support's normal"}
    return sources[source]


def object_color(number: int) -> Color:
    """Return the colour of an object."""
    return _OBJECT_COLORS[(number - FIRST_OBJECT) % len(_OBJECT_COLORS)]


def scene_picture(scene: Scene) -> NDArray[np.uint8]:
    """Return the image (H, W, 3): grey by depth, with objects and their outlines in colour."""
    depth = scene.image.points_C[..., 2]
    labels = scene.label_image()
    seen = np.isfinite(depth)
    near, far = np.quantile(depth[seen], [0.01, 0.99])
    shade = np.clip((np.nan_to_num(depth, nan=far) - near) / max(far - near, 1e-6), 0.0, 1.0)
    picture = np.repeat((0.25 + 0.7 * shade)[..., None], 3, axis=-1)
    picture[~seen] = 1.0
    for found in scene.objects:
        mask = labels == found.number
        picture[mask] = 0.35 * picture[mask] + 0.65 * np.array(object_color(found.number))
    picture = np.round(255.0 * picture).astype(np.uint8)
    for found in scene.objects:
        row, column = _pixels(scene, found.boundary.points)
        for kind, color in BOUNDARY_COLORS.items():
            of_kind = found.boundary.kind == kind
            picture[row[of_kind], column[of_kind]] = np.round(255.0 * np.array(color))
    return picture


def _pixels(scene: Scene, points: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns (N,) of the scene's nearest points."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(scene.cloud.points).query(points)
    row, column = scene.image.pixel[nearest].T
    return row, column


def _legend(solutions: ContactSolutions | None) -> list[tuple[str, str]]:
    names = {
        BoundaryKind.SEEN: "outline seen",
        BoundaryKind.OCCLUDED: "outline occluded by another thing",
        BoundaryKind.CUT: "outline cut by the view's border",
    }
    legend = [(_SUPPORT_COLOR, "support"), (GREY, "neither support nor object")]
    legend += [(BOUNDARY_COLORS[kind], name) for kind, name in names.items()]
    if solutions is not None:
        legend.append((solution_color(1, True), "best contact"))
        if solutions.hidden:
            legend.append((ORANGE, "where the best contact may be instead"))
    return [(_css(color), label) for color, label in legend]


def _row(found: Any) -> dict[str, Any]:
    shares = {kind.name.lower(): f"{found.boundary.share(kind):.0%}" for kind in BoundaryKind}
    return {
        "number": found.number,
        "color": _css(object_color(found.number)),
        "size": " x ".join(f"{100.0 * size:.1f}" for size in found.box.size),
        "distance": f"{found.distance:.2f}",
        "points": f"{len(found.indices):,}",
        **shares,
    }


def _notes(solutions: ContactSolutions | None) -> list[str]:
    if solutions is None or not solutions.solutions:
        return []
    notes = []
    for solution in solutions.solutions:
        where = "; ".join(" ".join(f"{x:+.3f}" for x in p) for p in solution.X_SG.p)
        state = "feasible" if solution.feasible else ", ".join(map(str, solution.reasons))
        notes.append(f"Contact {solution.rank}: at {where} m, {state}.")
    for extent in solutions.hidden:
        notes += extent.sentences(solutions[0].X_SG.p)
    return notes


def _data(scene: Scene, solutions: ContactSolutions | None, chosen: int) -> dict[str, Any]:
    """Return what the page's script draws; positions are relative to the scene's middle."""
    points, colors, owner, sizes = _drawn(scene, solutions)
    on_objects = scene.cloud.points[scene.labels >= FIRST_OBJECT]
    center = on_objects.mean(axis=0)
    radius = float(np.quantile(np.linalg.norm(on_objects - center, axis=1), 0.98))
    viewpoint = scene.image.viewpoint
    front = scene.image.R_SC[:, 1] if viewpoint is None else viewpoint - center
    height, width = scene.image.shape
    file = scene.cloud.path or "SCENE"
    camera = " --camera CAMERA.yaml" if scene.cloud.camera is not None else ""
    return {
        "points": _encoded((points - center).astype("<f4")),
        "colors": _encoded(np.round(255.0 * colors).astype(np.uint8)),
        "owner": _encoded(owner.astype(np.uint8)),
        "sizes": _encoded(sizes.astype(np.uint8)),
        "labels": _encoded(np.minimum(scene.label_image(), _DRAWN - 1).astype(np.uint8)),
        "picture": _png(scene_picture(scene)),
        "width": width,
        "height": height,
        "up": scene.gravity.up.tolist(),
        "front": front.tolist(),
        "distance": max(3.0 * radius, 0.3),
        "numbers": [found.number for found in scene.objects],
        "chosen": chosen,
        "command": f"drake-aerial transfer SKILL {file}{camera} --object {{N}} --out contacts.json",
    }


def _drawn(
    scene: Scene, solutions: ContactSolutions | None
) -> tuple[Array, Array, NDArray[np.int64], NDArray[np.int64]]:
    """Return the points (N, 3), colours (N, 3), owners (N,) and sizes (N,) [pixels] to draw."""
    everything, labels = scene.cloud.points, scene.labels
    parts: list[tuple[Array, Any, int, int]] = []
    share = _MOST_OF_OBJECTS / max(int((labels >= FIRST_OBJECT).sum()), 1)
    for label, color in [(NOTHING, GREY), (SUPPORT, _SUPPORT_COLOR)]:
        points = everything[labels == label]
        parts.append((_thinned(points, (_MOST_POINTS - _MOST_OF_OBJECTS) // 2), color, label, 5))
    for found in scene.objects:
        points = everything[labels == found.number]
        points = _thinned(points, max(int(share * len(points)), 200))
        parts.append((points, object_color(found.number), min(found.number, _DRAWN - 1), 6))
        for kind, color in BOUNDARY_COLORS.items():
            edge = _thinned(found.boundary.points_of(kind), 1000)
            parts.append((edge, color, min(found.number, _DRAWN - 1), 9))
    parts += [(points, color, _DRAWN, size) for points, color, size in _marks(scene, solutions)]
    return (
        np.vstack([points for points, *_ in parts]),
        np.vstack([np.tile(color, (len(points), 1)) for points, color, *_ in parts]),
        np.concatenate([np.full(len(points), owner) for points, _, owner, _ in parts]),
        np.concatenate([np.full(len(points), size) for points, *_, size in parts]),
    )


def _marks(scene: Scene, solutions: ContactSolutions | None) -> list[tuple[Array, Color, int]]:
    """Return points, colour and size of the gravity arrow and the contacts."""
    up, boxes = scene.gravity.up, [found.box for found in scene.objects]
    largest = max(boxes, key=lambda box: float(np.prod(box.size)))
    length = float(largest.size.max())
    foot = largest.center + (0.5 * largest.size[2] + 0.15 * length) * up
    side = scene.image.R_SC[:, 0] - up * (scene.image.R_SC[:, 0] @ up)
    tip = np.linspace(0.0, 0.2 * length, 40)[:, None]
    top = foot + 0.6 * length * up
    arrow = [foot + np.linspace(0.0, 0.6 * length, 160)[:, None] * up]
    arrow += [top - tip * up + sign * 0.5 * tip * side for sign in (-1.0, 1.0)]
    marks: list[tuple[Array, Color, int]] = [(np.vstack(arrow), BLACK, 8)]
    if solutions is None or not solutions.solutions:
        return marks
    for solution in reversed(solutions.solutions):
        color, stalk = solution_color(solution.rank, solution.feasible), np.linspace(0.0, 0.08, 60)
        for p, normal in zip(solution.X_SG.p, solution.normal):
            marks.append((p + stalk[:, None] * normal, color, 8 if solution.rank > 1 else 13))
    for extent in solutions.hidden:
        for k, p in enumerate(solutions[0].X_SG.p):
            along = np.linspace(*extent.about(p, k), 120)[:, None]
            marks.append((p + 0.005 * up + along * extent.direction, ORANGE, 8))
    return marks


def _thinned(points: Array, most: int) -> Array:
    return points[:: max(1, -(-len(points) // max(most, 1)))]


def _encoded(array: NDArray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _png(picture: NDArray[np.uint8]) -> str:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "PNG")
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def _css(color: Color) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in color)
