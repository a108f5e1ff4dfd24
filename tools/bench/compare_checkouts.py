#!/usr/bin/env python3
"""Compare contacts, flights and study records of two checkouts of the package.

Contacts of six scans by all methods, flights without air (one quadrotor with each kind of cable,
three quadrotors), and the records of a small study. Each checkout computes in a process of its own
and uses only names that the package root exports. Files that the first checkout wrote
(contacts.json, a skill, a trial) are read by the second. Timings and dates are not compared.

    git worktree add ../before edd3157
    tools/run python tools/bench/compare_checkouts.py ../before .
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

METHODS = ("task", "paper", "kopicki", "control", "centroid")
# Demonstration, and the payload whose scan is asked for.
ROWS = {
    "box": ("flat", "box_68x68x28"),
    "parcel": ("edge", "ridged_parcel"),
    "bunny": ("curved", "bunny"),
    "teapot": ("curved", "teapot"),
    "triangle": ("formation", "hollow_triangle"),
    "large box": ("formation", "box_68x68x28"),
}
FLIGHTS = {
    "n = 1": ("box", {"belief": "below_contact"}),
    "n = 1, elastic": ("box", {"cable": "elastic", "belief": "true"}),
    "n = 1, geometric": ("box", {"controller": "geometric_ff"}),
    "n = 3": ("triangle", {"belief": "geometric"}),
}
PLAN = """
name: small
seed: 5
defaults: {points: 6000, flight_noise: 0.01}
conditions:
  - {name: A, demonstration: flat, payload: box_68x61x28, view: top}
flights:
  - conditions: [A]
    methods: [task, kopicki]
    beliefs: [below_contact]
    inertias: [table]
    solutions: 2
    trials: 2
"""
# Of a document, what tells nothing of the result.
LEFT_OUT = ("timing", "date", "package_version", "version", "written", "python", "versions")
LEFT_OUT += ("air",)


def stripped(value):
    """Return a document without timings and versions."""
    if isinstance(value, dict):
        return {k: stripped(v) for k, v in value.items() if k not in LEFT_OUT}
    return [stripped(v) for v in value] if isinstance(value, list) else value


def compute(scans: Path, out: Path) -> None:
    """Learn, transfer, fly and run a small study; write what came out."""
    import drake_aerial as da

    out.mkdir(parents=True)
    found = {}
    for row, (demonstration, payload) in ROWS.items():
        skill = da.learn(da.Demonstration.read(demonstration))
        skill.save(out / f"{demonstration}.skill.npz")
        for method in METHODS:
            contacts = da.transfer(
                skill, da.PointCloud.read(scans / f"{payload}.npy"), method=method, seed=3
            )
            contacts.write(out / f"{row}.{method}.contacts.json")
            found[row, method] = contacts
        if row in ("box", "triangle"):
            refined = da.refine(skill, found[row, "task"])
            refined.write(out / f"{row}.refined.contacts.json")
    station = {}
    if hasattr(da.StationParameters(), "air"):  # checkouts before it know no air
        station = {"parameters": da.StationParameters(air=None)}
    for name, (row, options) in FLIGHTS.items():
        contacts = found[row, "task"]
        options = {"payload": ROWS[row][1], "solution": contacts.best.rank, **options, **station}
        result = da.fly(contacts, seed=7, **options)
        (out / f"flight {name}.json").write_text(json.dumps(stripped(result.metrics)))
        np.savez(out / f"flight {name}.npz", **result.series)
        result.save(out / f"trial {name}")
    (out / "plan.yaml").write_text(PLAN)
    plan = da.StudyPlan.read(out / "plan.yaml")
    da.run_study(plan, out / "study", workers=0)
    lines = (out / "study" / "records.jsonl").read_text().splitlines()
    records = sorted((stripped(json.loads(line)) for line in lines), key=lambda r: str(r["key"]))
    (out / "study records.json").write_text(json.dumps(records))


def numbers(value) -> tuple[list[float], list]:
    """Return a document's numbers, and everything else of it."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return [], [value]
    if isinstance(value, (int, float)):
        return [float(value)], []
    pairs = [numbers(v) for v in (value.values() if isinstance(value, dict) else value)]
    keys = [sorted(value)] if isinstance(value, dict) else []
    return [x for p in pairs for x in p[0]], [*keys, *(x for p in pairs for x in p[1])]


def without_additions(value, before):
    """Return a JSON value without the keys that the value `before` does not have."""
    if isinstance(value, dict) and isinstance(before, dict):
        return {k: without_additions(v, before[k]) for k, v in value.items() if k in before}
    if isinstance(value, list) and isinstance(before, list) and len(value) == len(before):
        return [without_additions(v, w) for v, w in zip(value, before)]
    return value


def difference(a: Path, b: Path) -> tuple[str, float]:
    """Return what differs between two files in words, and the largest difference of numbers."""
    if a.suffix == ".npz":
        with np.load(a) as x, np.load(b) as y:
            if set(x) != set(y):
                return "other series", np.inf
            if any(x[k].shape != y[k].shape for k in x):
                return "other lengths", np.inf
            gaps = [
                np.abs(np.nan_to_num(x[k].astype(float) - y[k].astype(float))).max(initial=0.0)
                for k in x
            ]
            return "", float(max(gaps))
    x, y = (stripped(json.loads(p.read_text())) for p in (a, b))
    y = without_additions(y, x)
    (xn, xo), (yn, yo) = numbers(x), numbers(y)
    gap = float(np.abs(np.subtract(xn, yn)).max(initial=0.0)) if len(xn) == len(yn) else np.inf
    if xo != yo:
        other = next(((p, q) for p, q in zip(xo, yo) if p != q), (len(xo), len(yo)))
        return f"other words: {other[0]!r} against {other[1]!r}"[:160], gap
    return "", gap


def read_back(folder: Path) -> None:
    """Read the files that another checkout wrote; raise if one is refused."""
    import drake_aerial as da

    for path in sorted(folder.glob("*.contacts.json")):
        assert len(da.ContactSolutions.read(path)) > 0
    for path in sorted(folder.glob("*.skill.npz")):
        assert len(da.read_skill(path)) > 0
    for path in sorted(folder.glob("trial */trial.npz")):
        assert da.TrialResult.load(path.parent).series
    print(
        f"read back: {len(list(folder.glob('*.contacts.json')))} contacts.json, skills and trials"
    )


def run(checkout: Path, *arguments: str) -> None:
    """Run this script in a process that imports the package of a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout.resolve()), "OMP_NUM_THREADS": "2"}
    subprocess.run(
        [sys.executable, str(Path(__file__).resolve()), *arguments], env=environment, check=True
    )


def main() -> int:
    """Print a line for each result and return 1 if one differs by more than 1e-12."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("checkouts", nargs="*", type=Path, help="two folders")
    parser.add_argument("--keep", type=Path, help="a folder for the results; first ones are reused")
    parser.add_argument("--compute", nargs=2, metavar=("SCANS", "OUT"), help=argparse.SUPPRESS)
    parser.add_argument("--read", metavar="FOLDER", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.compute:
        compute(*map(Path, arguments.compute))
        return 0
    if arguments.read:
        read_back(Path(arguments.read))
        return 0
    first, second = arguments.checkouts
    root = arguments.keep or Path(tempfile.mkdtemp())
    scans = root / "scans"
    if not scans.exists():
        import drake_aerial as da

        scans.mkdir(parents=True)
        for payload in {payload for _, payload in ROWS.values()}:
            np.save(scans / f"{payload}.npy", da.read_scan(payload).points)
    if not (root / "first").exists():
        run(first, "--compute", str(scans), str(root / "first"))
    subprocess.run(["rm", "-rf", str(root / "second")], check=True)
    run(second, "--compute", str(scans), str(root / "second"))
    run(second, "--read", str(root / "first"))
    failed = False
    files = sorted(
        p.relative_to(root / "first")
        for p in (root / "first").iterdir()
        if p.suffix in (".json", ".npz")
    )
    for name in files:
        if ".skill." in str(name):
            continue
        words, gap = difference(root / "first" / name, root / "second" / name)
        failed |= bool(words) or gap > 1e-12
        print(f"{name!s:40} {'equal' if gap == 0 and not words else f'{gap:.1e} {words}'}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
