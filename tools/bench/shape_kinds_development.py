"""The kinds of generated objects that are for development.

Each function draws the proportions of an object of extent `s` [m] and returns the shape.
"""

from __future__ import annotations

import numpy as np
from shape_parts import Part, Shape, arc, bent_bar, block, centred, frustum, ring_wall

SIGNS = np.array([[a, b] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
FLIP = np.array([[1.0, 1.0], [-1.0, 1.0]])
# Parts sink this far into their neighbours, so that no hidden face is sampled [m].
SINK = 0.002


def circle(radius: float) -> np.ndarray:
    angle = 2.0 * np.pi * np.arange(72) / 72
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def wall(s: float, share: float, most: float = 0.04) -> float:
    """Return a wall's thickness [m]: a share of the extent, at least 12 mm."""
    return float(np.clip(share * s, 0.012, most))


def box(rng, s: float) -> Shape:
    w, h = s / rng.uniform(1.25, 2.2), s * rng.uniform(0.15, 0.6)
    sites = {
        "centre": [0.0, 0.0],
        "quarter": FLIP * [s / 4, 0.0],
        "corner": SIGNS * [0.38 * s, 0.36 * w],
    }
    return Shape([centred((s, w, h))], sites)


def tray(rng, s: float) -> Shape:
    w, h, t = s / rng.uniform(1.25, 2.0), s * rng.uniform(0.1, 0.25), wall(s, 0.02)
    parts = [centred((s, w, t))]
    for k in (-1, 1):
        parts.append(centred((t, w, h), (k * (s - t) / 2, 0.0, 0.0)))
        parts.append(centred((s, t, h), (0.0, k * (w - t) / 2, 0.0)))
    return Shape(
        parts,
        {"floor": [0.0, 0.0], "rim": np.array([[0.0, 1.0], [0.0, -1.0]]) * (w - t) / 2},
    )


def l_shape(rng, s: float) -> Shape:
    b, w, h = s * rng.uniform(0.45, 0.8), s * rng.uniform(0.18, 0.3), s * rng.uniform(0.1, 0.3)
    parts = [block((0, s), (0, w), (0, h)), block((0, w), (0, b), (0, h))]
    sites = {
        "heel": [w / 2, w / 2],
        "long_end": [s - w / 2, w / 2],
        "short_end": [w / 2, b - w / 2],
    }
    return Shape(parts, sites)


def lid(rng, s: float) -> Shape:
    w, h = s / rng.uniform(1.2, 1.8), max(s * rng.uniform(0.05, 0.12), 0.015)
    r, top = s * rng.uniform(0.06, 0.11), s * rng.uniform(0.08, 0.16)
    at = np.array([s, w]) * [rng.choice([-1, 1]) * rng.uniform(0.18, 0.34), rng.uniform(-0.3, 0.3)]
    knob = frustum((r, r), (*at, h - SINK), top)
    return Shape([centred((s, w, h)), knob], {"knob": at, "plate": [0.0, 0.0]})


def stepped_box(rng, s: float) -> Shape:
    w, low = s / rng.uniform(1.3, 2.2), s * rng.uniform(0.12, 0.25)
    high, split = low + s * rng.uniform(0.1, 0.25), s * rng.uniform(0.35, 0.65)
    parts = [
        block((0, split), (-w / 2, w / 2), (0, low)),
        block((split - SINK, s), (-w / 2, w / 2), (0, high)),
    ]
    return Shape(parts, {"low": [split / 2, 0.0], "high": [(split + s) / 2, 0.0]})


def pan(rng, s: float) -> Shape:
    r, h = 0.5 * s * rng.uniform(0.5, 0.65), s * rng.uniform(0.08, 0.2)
    t = max(s * rng.uniform(0.03, 0.07), 0.02)
    length = s - 2 * r
    z = h * rng.uniform(0.4, 1.0) - min(t, 0.4 * h)
    parts = [
        frustum((r, r), (0.0, 0.0, 0.0), h),
        block((r - 0.05 * r, r + length), (-t / 2, t / 2), (z, z + min(t, 0.4 * h))),
    ]
    sites = {
        "handle_end": [r + 0.85 * length, 0.0],
        "handle_middle": [r + 0.5 * length, 0.0],
        "disc": [0.0, 0.0],
    }
    return Shape(parts, sites)


def cone(rng, s: float) -> Shape:
    r0 = 0.5 * s
    r1 = r0 * rng.uniform(0.15, 0.5)
    parts = [frustum((r0, r1), (0.0, 0.0, 0.0), s * rng.uniform(0.4, 0.95))]
    return Shape(parts, {"top": [0.0, 0.0], "flank": circle(0.5 * (r0 + r1))})


def mug(rng, s: float) -> Shape:
    r, h = s * rng.uniform(0.3, 0.36), s * rng.uniform(0.6, 1.0)
    reach, t, bar = s - 2 * r, wall(s, 0.03), max(0.04 * s, 0.011)
    low, high = h * rng.uniform(0.1, 0.3), h * rng.uniform(0.75, 0.95)
    parts = [frustum((r - t / 2, r - t / 2), (0.0, 0.0, 0.0), t), *ring_wall(r, t, (0.0, h))]
    path = arc((r - t / 2, 0.0, (low + high) / 2), (reach - bar, (high - low) / 2), (90.0, -90.0))
    parts += bent_bar(path, (bar, bar))
    return Shape(parts, {"handle": [r + 0.4 * reach, 0.0], "rim_opposite": [-r + t / 2, 0.0]})


def arch(rng, s: float) -> Shape:
    depth, t = s * rng.uniform(0.15, 0.35), s * rng.uniform(0.1, 0.16)
    r, leg = 0.5 * (s - t), s * rng.uniform(0.15, 0.5)
    rise = r * rng.uniform(0.6, 1.0)
    parts = bent_bar(arc((0.0, 0.0, leg), (r, rise), (0.0, 180.0), 20), (depth / 2, t / 2))
    for k in (-1, 1):
        parts.append(centred((t, depth, leg + SINK), (k * r, 0.0, 0.0)))
    return Shape(parts, {"keystone": [0.0, 0.0], "haunch": FLIP * [0.7 * r, 0.0]})


def table(rng, s: float) -> Shape:
    w, h, t = s / rng.uniform(1.25, 2.0), s * rng.uniform(0.3, 0.8), wall(s, 0.04, 0.05)
    leg = max(s * rng.uniform(0.05, 0.1), 0.025)
    inset = rng.uniform(0.0, 0.08) * s + leg / 2
    parts = [centred((s, w, t), (0.0, 0.0, h - t))]
    at = SIGNS * [s / 2 - inset, w / 2 - inset]
    parts += [centred((leg, leg, h - t + SINK), (*p, 0.0)) for p in at]
    return Shape(parts, {"centre": [0.0, 0.0], "over_leg": at})


def dumbbell(rng, s: float) -> Shape:
    a, b = s * rng.uniform(0.26, 0.38), s * rng.uniform(0.12, 0.22)
    h, bar = a * rng.uniform(0.5, 1.0), max(s * rng.uniform(0.04, 0.08), 0.025)
    low = 0.5 * min(h, b) * rng.uniform(0.4, 1.0)
    parts = [
        block((0, a), (-a / 2, a / 2), (0, h)),
        block((s - b, s), (-b / 2, b / 2), (0, b)),
        block((a - SINK, s - b + SINK), (-bar / 2, bar / 2), (low, low + bar)),
    ]
    sites = {"bar": [(a + s - b) / 2, 0.0], "big": [a / 2, 0.0], "small": [s - b / 2, 0.0]}
    return Shape(parts, sites)


def rock(rng, s: float) -> Shape:
    direction = rng.standard_normal((60, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    half = 0.5 * s * np.array([1.0, rng.uniform(0.6, 0.8), rng.uniform(0.4, 0.7)])
    points = direction * half * rng.uniform(0.85, 1.0, (60, 1))
    points[:, 2] -= points[:, 2].min()
    import trimesh

    middle = trimesh.convex.convex_hull(points).center_mass
    return Shape([Part(points)], {"over_centroid": middle[:2]})


def wedge(rng, s: float) -> Shape:
    w, high = s * rng.uniform(0.45, 0.8), s * rng.uniform(0.25, 0.55)
    low = high * rng.uniform(0.1, 0.3)
    profile = [(0.0, 0.0), (s, 0.0), (s, high), (0.0, low)]
    part = Part(np.array([[x, y, z] for x, z in profile for y in (-w / 2, w / 2)]))
    return Shape([part], {"slope": [s / 2, 0.0], "high_edge": [0.92 * s, 0.0]})


def frame(rng, s: float) -> Shape:
    w, bar = s / rng.uniform(1.3, 2.0), max(s * rng.uniform(0.07, 0.14), 0.025)
    h = max(s * rng.uniform(0.03, 0.1), 0.015)
    parts = []
    for k in (-1, 1):
        parts.append(centred((bar, w, h), (k * (s - bar) / 2, 0.0, 0.0)))
        parts.append(centred((s, bar, h), (0.0, k * (w - bar) / 2, 0.0)))
    sites = {
        "short_side": FLIP * [(s - bar) / 2, 0.0],
        "long_side": np.array([[0.0, 1.0], [0.0, -1.0]]) * (w - bar) / 2,
        "corner": SIGNS * [(s - bar) / 2, (w - bar) / 2],
    }
    return Shape(parts, sites)


KINDS = {
    "box": (box, ("centre", "quarter", "corner")),
    "tray": (tray, ("floor", "rim"), (0.25, 1.5)),
    "l_shape": (l_shape, ("heel", "long_end", "short_end"), (0.2, 2.0)),
    "lid": (lid, ("knob", "plate"), (0.2, 1.2)),
    "stepped_box": (stepped_box, ("low", "high"), (0.2, 2.0)),
    "pan": (pan, ("handle_end", "handle_middle", "disc"), (0.25, 1.5)),
    "cone": (cone, ("top", "flank"), (0.15, 1.2)),
    "mug": (mug, ("handle", "rim_opposite"), (0.18, 0.8)),
    "arch": (arch, ("keystone", "haunch"), (0.25, 1.5)),
    "table": (table, ("centre", "over_leg"), (0.3, 2.0)),
    "dumbbell": (dumbbell, ("bar", "big", "small"), (0.25, 1.5)),
    "rock": (rock, ("over_centroid",), (0.15, 1.2)),
    "wedge": (wedge, ("slope", "high_edge"), (0.2, 1.5)),
    "frame": (frame, ("short_side", "long_side", "corner"), (0.3, 1.5)),
}
