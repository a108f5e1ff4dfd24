#!/usr/bin/env python3
"""Reproducibility: the same inputs and seeds in one process, in another, and by another Python.

Contacts: six scans (boxes, bunny, teapot, bar, hollow triangle; one, two and three grippers),
learnt and transferred by all four methods. Flights: one and three quadrotors from the ground,
with noise. Scans are drawn once and passed to all as files. The second process uses other
threads, the other Python may have another Drake and numpy. Bytes are compared (contacts.json and
metrics.json without their timing, all series), and between interpreters the largest differences
of numbers.

    tools/run python tools/bench/same_again.py                             this Python only
    tools/run python tools/bench/same_again.py --other .venv312/bin/python    and another one, in
                                     which the package's dependencies are installed
    tools/run python tools/bench/same_again.py --rows bunny --flights 0    a part
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scans import box_query, curved_mesh, curved_query, mesh_query

import drake_aerial as da
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.suspended_payload import SuspendedPayload

METHODS = ("task", "paper", "kopicki", "centroid")
ROWS = {
    "box": ("flat", box_query((0.45, 0.35, 0.25), noise=0.001)),
    "bunny": ("curved", curved_query("bunny")),
    "teapot": ("curved", curved_query("teapot")),
    "bar": ("bar", box_query((1.2, 0.12, 0.08), noise=0.001)),
    "triangle": ("formation", mesh_query(lambda: curved_mesh("hollow_triangle"))),
    "large box": ("formation", box_query((0.68, 0.68, 0.28), noise=0.001)),
}
CONTACTS = {
    1: [[0.05, 0.02, 0.14]],
    3: [[-0.154, -0.267, 0.14], [0.308, 0.0, 0.14], [-0.154, 0.267, 0.14]],
}
LIMIT = 1e-9
DEPENDENCIES = ("drake", "numpy", "scipy", "open3d", "trimesh", "piqp")


def compute(folder: Path, rows: list[str], flights: list[int], out: Path) -> None:
    """Learn, transfer and fly, and write what came out but for its timing."""
    out.mkdir(parents=True)
    for row in rows:
        demonstration = ROWS[row][0]
        skill = da.learn(da.Demonstration.read(demonstration))
        skill.save(out / f"{demonstration}.skill.npz")
        for method in METHODS:
            solutions = da.transfer(
                skill, da.PointCloud.read(folder / f"{row}.npy"), method=method, seed=3
            )
            document = {key: value for key, value in solutions.to_dict().items() if key != "timing"}
            (out / f"{row}.{method}.json").write_text(json.dumps(document))
    for n in flights:
        held = SuspendedPayload.from_contacts(
            da.Payload.read("box_68x61x28"), CONTACTS[n], np.tile([0.0, 0.0, 1.0], (n, 1))
        )
        result = Flight(held).run(7)
        metrics = {key: value for key, value in result.metrics.items() if key != "timing"}
        (out / f"flight {n}.json").write_text(json.dumps(metrics))
        np.savez(out / f"flight {n}.series.npz", **result.series)


def computed_by(
    python: str, threads: int, times: int, arguments: argparse.Namespace, folder: Path, name: str
) -> Path:
    """Have a process of its own compute everything, once or more."""
    environment = {
        **os.environ,
        "OMP_NUM_THREADS": str(threads),
        "OPENBLAS_NUM_THREADS": str(threads),
    }
    environment["PYTHONPATH"] = str(Path(da.__file__).parent.parent)
    command = [python, str(Path(__file__).resolve()), "--compute", str(folder), name, str(times)]
    command += ["--rows", *arguments.rows, "--flights", *map(str, arguments.flights)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{python} failed:\n{done.stderr}")
    print(f"{name}: {done.stdout.strip()}; {threads} thread(s)", flush=True)
    return folder / name


def content(path: Path) -> dict[str, np.ndarray]:
    """Return all numbers of a file, by name."""
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            return {
                key: arrays[key]
                for key in arrays.files
                if np.issubdtype(arrays[key].dtype, np.number)
            }
    found: dict[str, list[float]] = {}

    def gather(key: str, value: object) -> None:
        if isinstance(value, dict):
            for name, inner in value.items():
                gather(name, inner)
        elif isinstance(value, list):
            for inner in value:
                gather(key, inner)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found.setdefault(key, []).append(float(value))

    gather("", json.loads(path.read_text()))
    return {key: np.array(values) for key, values in found.items()}


def same_bytes(a: Path, b: Path) -> bool:
    if a.suffix != ".npz":
        return a.read_bytes() == b.read_bytes()
    # Archives carry the moment at which they were written.
    with np.load(a) as left, np.load(b) as right:
        return left.files == right.files and all(
            left[key].tobytes() == right[key].tobytes() for key in left.files
        )


def largest_differences(a: Path, b: Path) -> dict[str, float]:
    """Return the largest difference under each name; infinite if shapes or NaNs differ."""
    left, right = content(a), content(b)
    answer = {}
    for key in sorted({*left, *right}):
        x, y = left.get(key, np.zeros(0)), right.get(key, np.zeros(0))
        if x.shape != y.shape or np.any(np.isnan(x) != np.isnan(y)):
            answer[key] = np.inf
        elif x.size:
            with np.errstate(invalid="ignore"):
                difference = np.abs(x.astype(float) - y.astype(float))
            answer[key] = float(np.max(difference[(x != y) & ~np.isnan(x)], initial=0.0))
    return answer


def compare(here: Path, others: dict[str, Path], elsewhere: Path | None) -> bool:
    """Print the tables; return whether everything is as it should be."""
    right = True
    heads = "".join(f"{name:>18}" for name in others)
    print(
        f"\n{'':<24}{heads}"
        + (f"{'position':>12}{'quaternion':>12}{'likelihood':>12}" if elsewhere else "")
    )
    for path in sorted(here.iterdir()):
        same = [same_bytes(path, other / path.name) for other in others.values()]
        right &= all(same)
        line = f"{path.name.removesuffix('.json').removesuffix('.npz'):<24}"
        line += "".join(f"{'same bytes' if s else 'DIFFER':>18}" for s in same)
        if elsewhere is not None:
            differences = largest_differences(path, elsewhere / path.name)
            if path.name.startswith("flight"):
                worst = sorted(differences, key=lambda key: -differences[key])[:3]
                line += "  " + ", ".join(f"{key} {differences[key]:.0e}" for key in worst)
            elif path.suffix == ".npz":
                worst = max(differences, key=lambda key: differences[key])
                line += f"  {worst} {differences[worst]:.0e}"
            else:
                names = ("position", "quaternion_wxyz", "log_likelihood")
                line += "".join(f"{differences.get(name, 0.0):>12.0e}" for name in names)
                far = max(differences.values()) > LIMIT
                right &= not far
                line += "  MORE THAN 1e-9" * far
        print(line)
    return right


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--other", metavar="PYTHON", help="another interpreter, to be compared with"
    )
    parser.add_argument("--rows", nargs="*", choices=list(ROWS), default=list(ROWS))
    parser.add_argument(
        "--flights",
        nargs="*",
        type=int,
        choices=(0, *CONTACTS),
        default=list(CONTACTS),
        help="0: none",
    )
    parser.add_argument("--compute", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.compute:
        folder, name, times = (
            Path(arguments.compute[0]),
            arguments.compute[1],
            int(arguments.compute[2]),
        )
        flights = [n for n in arguments.flights if n]
        for k in range(times):
            compute(folder, arguments.rows, flights, folder / name / str(k))
        print(
            f"Python {sys.version.split()[0]}, "
            + ", ".join(f"{name} {version(name)}" for name in DEPENDENCIES)
        )
        return 0
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for k, row in enumerate(arguments.rows):
            np.save(folder / f"{row}.npy", ROWS[row][1](np.random.default_rng(500 + k))[0].points)
        twice = computed_by(sys.executable, 1, 2, arguments, folder, "this process")
        others = {"again": twice / "1"}
        others["other process"] = (
            computed_by(sys.executable, 2, 1, arguments, folder, "other process") / "0"
        )
        elsewhere = None
        if arguments.other:
            elsewhere = computed_by(arguments.other, 1, 1, arguments, folder, "other Python") / "0"
        right = compare(twice / "0", others, elsewhere)
    print(
        f"\nwanted: same bytes by one Python, contacts within {LIMIT:g} across: "
        + ("so it is" if right else "MISSED")
    )
    return int(not right)


if __name__ == "__main__":
    sys.exit(main())
