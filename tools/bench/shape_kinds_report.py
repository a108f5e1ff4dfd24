"""The kinds of generated objects that are for reports, and are not looked at in development.

Each function draws the proportions of an object of extent `s` [m] and returns the shape.
"""

from __future__ import annotations

import numpy as np
from shape_kinds_development import FLIP, SINK, circle, wall
from shape_parts import Part, Shape, arc, bent_bar, block, centred, frustum


def cylinder(rng, s: float) -> Shape:
    part = frustum((s / 2, s / 2), (0.0, 0.0, 0.0), s * rng.uniform(0.15, 0.9))
    return Shape([part], {"centre": [0.0, 0.0], "off_axis": circle(0.325 * s)})


def channel(rng, s: float) -> Shape:
    w, h, t = s * rng.uniform(0.25, 0.45), s * rng.uniform(0.1, 0.3), wall(s, 0.02, 0.03)
    parts = [centred((s, w, t))]
    parts += [centred((s, t, h), (0.0, k * (w - t) / 2, 0.0)) for k in (-1, 1)]
    return Shape(
        parts,
        {"floor": [0.0, 0.0], "wall": np.array([[0.0, 1.0], [0.0, -1.0]]) * (w - t) / 2},
    )


def u_shape(rng, s: float) -> Shape:
    a, w = s * rng.uniform(0.6, 0.9), s * rng.uniform(0.14, 0.2)
    b, h = s * rng.uniform(0.4, 0.75), s * rng.uniform(0.1, 0.3)
    parts = [
        block((0, w), (0, a), (0, h)),
        block((0, s), (0, w), (0, h)),
        block((0, b), (a - w, a), (0, h)),
    ]
    sites = {"bridge": [w / 2, a / 2], "long_end": [s - w / 2, w / 2]}
    return Shape(parts, sites)


def t_shape(rng, s: float) -> Shape:
    bar, w, h = s * rng.uniform(0.5, 0.95), s * rng.uniform(0.16, 0.26), s * rng.uniform(0.1, 0.3)
    parts = [
        block((0, w), (-bar / 2, bar / 2), (0, h)),
        block((0, s), (-w / 2, w / 2), (0, h)),
    ]
    return Shape(parts, {"junction": [w / 2, 0.0], "stem_end": [s - w / 2, 0.0]})


def chair(rng, s: float) -> Shape:
    d, w = s * rng.uniform(0.4, 0.6), s * rng.uniform(0.4, 0.6)
    seat, t = s * rng.uniform(0.4, 0.55), max(s * rng.uniform(0.05, 0.09), 0.02)
    leg = max(0.07 * s, 0.025)
    parts = [
        centred((d, w, t), (0.0, 0.0, seat - t)),
        block((-d / 2, -d / 2 + t), (-w / 2, w / 2), (seat - t, s)),
    ]
    for i in (-1, 1):
        for j in (-1, 1):
            at = (i * (d - leg) / 2, j * (w - leg) / 2, 0.0)
            parts.append(centred((leg, leg, seat - t + SINK), at))
    sites = {
        "seat": [t / 2, 0.0],
        "back": [-d / 2 + t / 2, 0.0],
        "front": [0.42 * d, 0.0],
    }
    return Shape(parts, sites)


def crate(rng, s: float) -> Shape:
    w, h = s / rng.uniform(1.25, 1.9), s * rng.uniform(0.25, 0.5)
    at = s * rng.choice([-1, 1]) * rng.uniform(0.12, 0.32)
    span, rise = w * rng.uniform(0.3, 0.5), s * rng.uniform(0.1, 0.18)
    bar = max(s * rng.uniform(0.04, 0.07), 0.022)
    parts = [centred((s, w, h)), centred((bar, span, bar), (at, 0.0, h + rise - bar))]
    for k in (-1, 1):
        parts.append(centred((bar, bar, rise), (at, k * (span - bar) / 2, h - SINK)))
    free = 0.5 * (at - np.sign(at) * s / 2)
    return Shape(parts, {"handle": [at, 0.0], "free_top": [free, 0.0]})


def pallet(rng, s: float) -> Shape:
    w, t = s / rng.uniform(1.2, 1.6), wall(s, 0.025, 0.03)
    h, boards = s * rng.uniform(0.08, 0.15), int(rng.choice([5, 7]))
    width = s / boards * rng.uniform(0.6, 0.8)
    at = np.linspace(-(s - width) / 2, (s - width) / 2, boards)
    parts = [centred((width, w, t), (x, 0.0, h - t)) for x in at]
    beam = w * 0.12
    for k in (-1, 0, 1):
        parts.append(centred((s, beam, h - t + SINK), (0.0, k * (w - beam) / 2, 0.0)))
    return Shape(parts, {"centre": [0.0, 0.0], "end_board": FLIP * [at[-1], 0.0]})


def bottle(rng, s: float) -> Shape:
    r = s * rng.uniform(0.12, 0.2)
    neck = max(r * rng.uniform(0.3, 0.5), 0.012)
    body, taper = s * rng.uniform(0.45, 0.6), s * rng.uniform(0.1, 0.18)
    parts = [
        frustum((r, r), (0.0, 0.0, r), body, axis=0),
        frustum((r, neck), (body - SINK, 0.0, r), taper + SINK, axis=0),
        frustum((neck, neck), (body + taper - SINK, 0.0, r), s - body - taper + SINK, axis=0),
    ]
    return Shape(parts, {"body": [body / 2, 0.0], "neck": [(body + taper + s) / 2, 0.0]})


def roof(rng, s: float) -> Shape:
    w, h, rise = s * rng.uniform(0.45, 0.75), s * rng.uniform(0.1, 0.4), s * rng.uniform(0.15, 0.35)
    ridge = [[x, 0.0, h + rise] for x in (-s / 2, s / 2)]
    base = [[x, y, h - SINK] for x in (-s / 2, s / 2) for y in (-w / 2, w / 2)]
    parts = [centred((s, w, h)), Part(np.array(ridge + base))]
    sites = {
        "ridge": [0.0, 0.0],
        "slope": np.array([[0.0, 1.0], [0.0, -1.0]]) * w / 4,
        "ridge_end": FLIP * [0.42 * s, 0.0],
    }
    return Shape(parts, sites)


def stairs(rng, s: float) -> Shape:
    w, edges = s * rng.uniform(0.4, 0.9), s * np.array([0.0, 0.0, 0.0, 1.0])
    edges[1:3] = s * (np.array([1.0, 2.0]) / 3 + rng.uniform(-0.09, 0.09, 2))
    height = np.cumsum(s * rng.uniform(0.1, 0.25, 3))
    parts = [
        block((max(a - SINK, 0.0), b), (-w / 2, w / 2), (0, h))
        for a, b, h in zip(edges[:-1], edges[1:], height, strict=True)
    ]
    middle = 0.5 * (edges[1:] + edges[:-1])
    sites = {name: [x, 0.0] for name, x in zip(("bottom", "middle", "top"), middle, strict=True)}
    return Shape(parts, sites)


def cross(rng, s: float) -> Shape:
    bar, w = s * rng.uniform(0.5, 0.85), s * rng.uniform(0.12, 0.2)
    h, at = s * rng.uniform(0.08, 0.25), s * rng.uniform(0.22, 0.4)
    parts = [
        block((0, s), (-w / 2, w / 2), (0, h)),
        block((at - w / 2, at + w / 2), (-bar / 2, bar / 2), (0, h)),
    ]
    sites = {
        "crossing": [at, 0.0],
        "long_end": [s - w / 2, 0.0],
        "bar_end": np.array([[at, 1.0], [at, -1.0]]) * [1.0, (bar - w) / 2],
    }
    return Shape(parts, sites)


def basket(rng, s: float) -> Shape:
    w, h, t = s / rng.uniform(1.25, 1.8), s * rng.uniform(0.2, 0.4), wall(s, 0.025)
    parts = [centred((s, w, t))]
    for k in (-1, 1):
        parts.append(centred((t, w, h), (k * (s - t) / 2, 0.0, 0.0)))
        parts.append(centred((s, t, h), (0.0, k * (w - t) / 2, 0.0)))
    bar, rise = max(0.03 * s, 0.013), s * rng.uniform(0.25, 0.45)
    at = s * rng.uniform(-0.2, 0.2)
    path = arc((0.0, 0.0, h - bar), (w / 2 - t / 2, rise), (0.0, 180.0), 20)
    # The hoop stands across the basket.
    path = np.column_stack([path[:, 1] + at, path[:, 0], path[:, 2]])
    parts += bent_bar(path, (bar, bar), across=(1.0, 0.0, 0.0))
    return Shape(parts, {"hoop": [at, 0.0], "end_rim": FLIP * [(s - t) / 2, 0.0]})


def jerrycan(rng, s: float) -> Shape:
    length, w, h = s * rng.uniform(0.6, 0.8), s * rng.uniform(0.3, 0.45), s * rng.uniform(0.7, 0.85)
    spout = max(s * rng.uniform(0.05, 0.08), 0.02)
    bar, rise = max(0.05 * s, 0.02), (s - h) * rng.uniform(0.6, 1.0)
    span = length * rng.uniform(0.35, 0.5)
    at = length * rng.uniform(-0.2, 0.0)
    parts = [
        centred((length, w, h)),
        centred((span, bar, bar), (at, 0.0, h + rise - bar)),
        frustum((spout, spout), (length / 2 - 1.4 * spout, 0.0, h - SINK), s - h),
    ]
    for k in (-1, 1):
        parts.append(centred((bar, bar, rise), (at + k * (span - bar) / 2, 0.0, h - SINK)))
    return Shape(parts, {"handle": [at, 0.0], "spout": [length / 2 - 1.4 * spout, 0.0]})


def hammer(rng, s: float) -> Shape:
    head, w = s * rng.uniform(0.14, 0.24), s * rng.uniform(0.3, 0.5)
    h, bar = s * rng.uniform(0.1, 0.2), max(s * rng.uniform(0.04, 0.07), 0.02)
    z = max(0.5 * (h - bar), 0.0)
    offset = w * rng.uniform(-0.15, 0.15)
    parts = [
        block((0, head), (offset - w / 2, offset + w / 2), (0, h)),
        block((head - SINK, s), (-bar / 2, bar / 2), (z, z + bar)),
    ]
    sites = {"head": [head / 2, offset], "grip": [head + 0.7 * (s - head), 0.0]}
    return Shape(parts, sites)


KINDS = {
    "cylinder": (cylinder, ("centre", "off_axis")),
    "channel": (channel, ("floor", "wall"), (0.25, 2.0)),
    "u_shape": (u_shape, ("bridge", "long_end"), (0.2, 2.0)),
    "t_shape": (t_shape, ("junction", "stem_end"), (0.2, 2.0)),
    "chair": (chair, ("seat", "back", "front"), (0.3, 1.2)),
    "crate": (crate, ("handle", "free_top"), (0.25, 1.2)),
    "pallet": (pallet, ("centre", "end_board"), (0.4, 1.5)),
    "bottle": (bottle, ("body", "neck"), (0.2, 1.2)),
    "roof": (roof, ("ridge", "slope", "ridge_end"), (0.2, 1.5)),
    "stairs": (stairs, ("bottom", "middle", "top"), (0.2, 1.5)),
    "cross": (cross, ("crossing", "long_end", "bar_end"), (0.25, 2.0)),
    "basket": (basket, ("hoop", "end_rim"), (0.25, 1.0)),
    "jerrycan": (jerrycan, ("handle", "spout"), (0.25, 1.0)),
    "hammer": (hammer, ("head", "grip"), (0.25, 1.5)),
}
