"""Measure the errors of contacts and gravity in rendered scenes, against what is true.

Each seed is a random scene (`rendered_scene.py`) with the noise of a structured-light camera. The
camera's image goes through `find_scene` and `transfer`; the object that covers most of the target
is taken. An error of the scene counts as a miss. Results are appended to `--out`, one line of JSON
for a scene; seeds that it holds are not run again.

    rendered_scenes.py --seeds 1000-1299 --out scenes.jsonl --figure scenes.png
    rendered_scenes.py --occluders corner notch strip --seeds 1000-1029 --out hidden.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from rendered_scene import CAMERA, OCCLUDERS, RenderedScene, random_scene, tray_mesh

from drake_aerial import Demonstration, learn, read_depth_image, read_skill, transfer
from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.errors import DrakeAerialError
from drake_aerial.scene.depth_noise import DepthNoise
from drake_aerial.scene.find_scene import find_scene
from drake_aerial.scene.object_choice import object_cloud

BINS = (0.0, 0.5, 0.8, 0.95, 1.01)
FOUND = 0.75


@cache
def skill_of(kind: str):
    """Return the skill for a kind of target: `flat`, `curved`, or one shown on another tray."""
    if kind == "tray":
        mesh = tray_mesh(0.5, 0.35, 0.09)
        view = partial_view(mesh, [0.0, 0.01, 1.6])
        return learn(Demonstration.make(view, [[0.0, 0.0, 0.015]], name="tray"))
    return read_skill("flat" if kind in ("box", "cylinder") else "curved")


def run(seed: int, occluder: str) -> dict:
    """Return the record of one scene."""
    scene = random_scene(seed, occluder)
    record = {
        "seed": seed,
        "occluder": occluder,
        "kind": scene.kind,
        "support": scene.support,
        "elevation": scene.elevation,
        "distance": float(np.linalg.norm(scene.X_WC.p)),
        "size": scene.size,
        "seen": scene.seen,
    }
    depth = DepthNoise().applied(scene.depth, np.random.default_rng([seed, 1]))
    millimetres = np.round(1000.0 * depth).astype(np.uint16)
    start = time.process_time()
    try:
        record |= contact_of(scene, millimetres)
    except DrakeAerialError as error:
        record["error"] = str(error).split(";")[0][:90]
    return record | {"cpu_s": time.process_time() - start}


def contact_of(scene: RenderedScene, image: np.ndarray) -> dict:
    """Return the errors of gravity and contact in one scene."""
    found = find_scene(read_depth_image(image, CAMERA))
    cosine = float(np.clip(found.gravity.up @ scene.up_C, -1.0, 1.0))
    record: dict = {"gravity_deg": float(np.rad2deg(np.arccos(cosine)))}
    labels, target = found.label_image(), (scene.labels == 2) & (image > 0)
    numbers, counts = np.unique(labels[target & (labels >= 2)], return_counts=True)
    if not len(numbers):
        return record | {"iou": 0.0, "error": "the target is not found"}
    number = int(numbers[np.argmax(counts)])
    mask = labels == number
    record["iou"] = float((mask & target).sum() / (mask | target).sum())
    solutions = transfer(skill_of(scene.kind), object_cloud(found, number), top=1)
    position, site = solutions[0].X_SG.p[0], scene.site_C
    record["contact_m"] = float(np.linalg.norm(position - site))
    record["feasible"] = solutions[0].feasible
    if solutions.hidden:
        record["hidden"] = [extent.about(site) for extent in solutions.hidden]
    return record


def table(records: list[dict]) -> str:
    """Return the errors by what is seen of the target, and of gravity, as text."""
    lines = ["seen          scenes  found  median  90 %   <= 2 cm  hidden  interval holds"]
    for low, high in pairwise(BINS):
        rows = [r for r in records if low <= r["seen"] < high]
        lines.append(_line(f"{low:.2f} to {min(high, 1.0):.2f}", rows))
    for occluder in OCCLUDERS:
        rows = [r for r in records if r["occluder"] == occluder]
        if occluder != "none" and rows:
            lines.append(_line(occluder, rows))
    for kind in sorted({r["kind"] for r in records}):
        lines.append(_line(kind, [r for r in records if r["kind"] == kind]))
    lines.append(_line("all", records))
    gravity = [r["gravity_deg"] for r in records if "gravity_deg" in r]
    if gravity:
        lines.append(
            f"gravity: median {np.median(gravity):.2f} deg, 95 % {np.quantile(gravity, 0.95):.2f} "
            f"deg, within 1 deg {np.sum(np.array(gravity) <= 1.0) / len(records):.2f} of all"
        )
    for text in sorted({r["error"] for r in records if "error" in r}):
        lines.append(f"{sum(r.get('error') == text for r in records):4d} x {text}")
    lines.append(f"CPU time: median {np.median([r['cpu_s'] for r in records]):.1f} s")
    return "\n".join(lines)


def _line(name: str, rows: list[dict]) -> str:
    if not rows:
        return f"{name:12s}  {0:6d}"
    # A scene that is missed or refused has an infinite error.
    errors = 100.0 * np.array([r.get("contact_m", np.inf) for r in rows])
    found = np.mean([r.get("iou", 0.0) > FOUND for r in rows])
    known = np.array(["hidden" not in r for r in rows])
    held = [all(a <= 0.0 <= b for a, b in r["hidden"]) for r in rows if "hidden" in r]
    two = np.mean(errors[known] <= 2.0) if known.any() else np.nan
    upper = np.sort(errors)[min(int(0.9 * len(errors)), len(errors) - 1)]
    return (
        f"{name:12s}  {len(rows):6d}  {found:5.2f}  {np.median(errors):6.1f}  {upper:5.1f}  "
        f"{two:7.2f}  {len(held):6d}  {np.mean(held) if held else np.nan:.2f}"
    )


def draw(records: list[dict], path: Path) -> None:
    """Draw the errors of contact and gravity over the fraction that is seen."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, key, scale, label in (
        (left, "contact_m", 100.0, "contact error [cm]"),
        (right, "gravity_deg", 1.0, "gravity error [deg]"),
    ):
        for kind in sorted({r["kind"] for r in records}):
            rows = [r for r in records if r["kind"] == kind and key in r]
            axes.plot([r["seen"] for r in rows], [scale * r[key] for r in rows], ".", label=kind)
        axes.set(xlabel="seen fraction of the target", ylabel=label, yscale="log")
        axes.grid(alpha=0.3)
    left.legend(fontsize=8)
    figure.savefig(path, dpi=130)


def main() -> None:
    """Run the seeds that are missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="1000-1019", help="first and last seed")
    parser.add_argument("--occluders", nargs="+", choices=OCCLUDERS, default=["none"])
    parser.add_argument("--out", type=Path, default=Path("rendered_scenes.jsonl"))
    parser.add_argument("--figure", type=Path, help="also draw a figure (.png)")
    parser.add_argument("--minutes", type=float, default=np.inf, help="stop after this time")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split("-"))
    records = []
    if arguments.out.exists():
        records = [json.loads(line) for line in arguments.out.read_text().splitlines()]
    done = {(r["seed"], r["occluder"]) for r in records}
    end = time.monotonic() + 60.0 * arguments.minutes
    for seed in range(first, last + 1):
        for occluder in arguments.occluders:
            if (seed, occluder) in done or time.monotonic() > end:
                continue
            records.append(run(seed, occluder))
            with arguments.out.open("a") as file:
                file.write(json.dumps(records[-1]) + "\n")
    print(table(records))
    if arguments.figure:
        draw(records, arguments.figure)


if __name__ == "__main__":
    main()
