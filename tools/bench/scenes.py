#!/usr/bin/env python3
"""Share of the objects of labelled depth images that are found, and contacts on them.

DIR holds pairs `NAME_depth.png` (16 bit, millimetres) and `NAME_labels.png` (8 bit: 0 nothing, 1-9
a support, 20-29 the parts of the first object, 30-39 of the second, ...), as converted from the
Object Segmentation Database (Richtsfeld et al., 2012). Settings were chosen on images with even
numbers; the table is for odd ones. An object counts if it has at least 300 labelled pixels. It is
found if one found object has an intersection over union of more than 0.75 with it.

Contacts: the skill `flat` is transferred to the found object and to the labelled pixels alone. The
two best contacts agree if they are within 1 cm or 5 % of the object's largest side. A missed or
refused object counts as a disagreement. On a support: contacts within 5 mm of it.

    tools/run python tools/bench/scenes.py DIR
    tools/run python tools/bench/scenes.py DIR --numbers even --contacts --pictures OUT
"""

from __future__ import annotations

import argparse
import re
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

GRADES = {"boxes": (0, 16), "stacked": (17, 24), "occluded": (25, 32), "cylinders": (33, 44)}
WANTED = {"boxes": 0.98, "stacked": 0.95, "occluded": 0.95, "cylinders": 0.92}
LEAST_PIXELS, LEAST_OVERLAP = 300, 0.75


def main() -> None:
    """Print the shares by grade."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--numbers", choices=("odd", "even", "all"), default="odd")
    parser.add_argument("--camera", help="camera file (default: fx = fy = 525, cx 319.5, cy 239.5)")
    parser.add_argument("--contacts", action="store_true", help="also compare contacts")
    parser.add_argument("--pictures", type=Path, metavar="OUT", help="write labels as colours")
    options = parser.parse_args()
    images = sorted(options.folder.glob("*_depth.png"), key=number_of)
    chosen = {"odd": (1,), "even": (0,), "all": (0, 1)}[options.numbers]
    images = [image for image in images if number_of(image) % 2 in chosen]
    results = defaultdict(list)
    seconds = []
    for image in images:
        rows, took = one_image(image, options)
        results[grade_of(image)] += rows
        seconds.append(took)
    print_table(results)
    print(f"scene: median {np.median(seconds):.2f} s, longest {max(seconds):.2f} s of CPU time")


def number_of(path: Path) -> int:
    """Return the number in a file's name."""
    found = re.findall(r"\d+", path.name)
    return int(found[0]) if found else 0


def grade_of(path: Path) -> str:
    """Return the grade of an image by its number."""
    number = number_of(path)
    for name, (first, last) in GRADES.items():
        if first <= number <= last:
            return name
    return "others"


def one_image(path: Path, options: argparse.Namespace) -> tuple[list[dict], float]:
    """Return a row for each labelled object, and the CPU seconds from cloud to scene."""
    from PIL import Image

    from drake_aerial import DepthCamera, read_depth_image
    from drake_aerial.scene.find_scene import find_scene

    labels = np.asarray(Image.open(path.with_name(path.name.replace("_depth", "_labels"))))
    height, width = labels.shape
    camera = options.camera or DepthCamera(width, height, 525.0, 525.0, 319.5, 239.5)
    cloud = read_depth_image(path, camera)
    start = time.process_time()
    scene = find_scene(cloud)
    took = time.process_time() - start
    found = scene.label_image()
    rows = []
    for decade in np.unique(labels[labels >= 20] // 10):
        pixels = labels // 10 == decade
        if np.count_nonzero(pixels) < LEAST_PIXELS:
            continue
        number, overlap = best_match(found, pixels)
        row = {"overlap": overlap}
        if options.contacts:
            row |= contacts(scene, number if overlap > LEAST_OVERLAP else None, pixels)
        rows.append(row)
        if overlap <= LEAST_OVERLAP:
            print(f"{path.name}: object {decade} has an overlap of {overlap:.2f}")
        if row.get("agree") is False:
            print(f"{path.name}: object {decade}: {row['why']}")
    if options.pictures:
        write_picture(found, options.pictures / path.name.replace("_depth", "_found"))
    return rows, took


def best_match(found: np.ndarray, pixels: np.ndarray) -> tuple[int, float]:
    """Return the found object that covers the pixels best, and its intersection over union."""
    best = (0, 0.0)
    for number in np.unique(found[pixels]):
        if number >= 2:
            own = found == number
            overlap = np.count_nonzero(own & pixels) / np.count_nonzero(own | pixels)
            best = max(best, (int(number), float(overlap)), key=lambda item: item[1])
    return best


def contacts(scene, number: int | None, pixels: np.ndarray) -> dict:
    """Return whether the best contacts of the found and the labelled object agree."""
    index = scene.image.index[pixels]
    labelled = replace(
        scene.cloud,
        points=scene.cloud.points[index[index >= 0]],
        up=scene.gravity.up,
        up_is_known=True,
    )
    size = float(np.ptp(labelled.points, axis=0).max())
    true = best_contact(labelled)
    if number is None:
        return {"agree": False, "why": "not found", "on_support": False}
    own = best_contact(scene.cloud_of(number))
    if true is None or own is None:
        why = "refused from the labels too" if true is None else "refused"
        return {"agree": False, "why": why, "on_support": False}
    distance = float(np.linalg.norm(true - own))
    height = min(abs(float(support.height(own))) for support in scene.supports)
    agree = distance <= max(0.01, 0.05 * size)
    why = f"{100.0 * distance:.1f} cm apart on an object of {100.0 * size:.0f} cm"
    return {"agree": agree, "why": why, "on_support": height < 0.005, "distance": distance}


def best_contact(cloud) -> np.ndarray | None:
    """Return the place (3,) of the best feasible contact of the skill `flat` [m], or None."""
    from drake_aerial import InputError, read_skill, transfer

    try:
        solutions = transfer(read_skill("flat"), cloud, seed=0)
    except InputError as error:
        print(f"  {error}")
        return None
    if not len(solutions):
        return None
    # Small objects may have no contact that can be flown; the likeliest is compared then.
    return np.asarray((solutions.best or solutions[0]).X_SG.p[0])


def write_picture(labels: np.ndarray, path: Path) -> None:
    """Write the labels as colours."""
    from PIL import Image

    colours = np.random.default_rng(3).integers(60, 255, (int(labels.max()) + 1, 3))
    colours[0], colours[1:2] = 0, 90
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(colours[labels].astype(np.uint8)).save(path)


def print_table(results: dict[str, list[dict]]) -> None:
    """Print one line for each grade."""
    print("grade        objects  found  wanted  median IoU  contacts agree  on the support")
    for grade, rows in results.items():
        overlap = np.array([row["overlap"] for row in rows])
        found = np.mean(overlap > LEAST_OVERLAP)
        line = f"{grade:12s} {len(rows):7d} {found:6.2f} {WANTED.get(grade, np.nan):7.2f}"
        line += f" {np.median(overlap):11.2f}"
        if rows and "agree" in rows[0]:
            line += f" {np.mean([row['agree'] for row in rows]):15.2f}"
            line += f" {sum(row['on_support'] for row in rows):15d}"
        print(line)


if __name__ == "__main__":
    main()
