"""Table of contacts on generated kinds of objects, by method.

    python tools/bench/held_out_shapes.py --half development [--kinds box tray] [--seeds 0-9]
    python tools/bench/held_out_shapes.py --half report

Each case teaches a site on one object and asks for it on another of the same kind, whose parts,
proportions, heights and size differ. A contact is right within the larger of 1.5 cm and 5 % of the
object's size of a place that the kind defines. Half of the kinds are for development; the other
half is for the report, with seeds that the commit's hash fixes, and its first run counts.

Even seeds show clean scans. Odd seeds take turns through noise, flying pixels, misregistered
views, 3 degrees of tilt, sparse and dense scans. `--condition cut` takes 38 % of every object away
and leaves the site. Records are kept as JSON lines in `--out`; an interrupted run resumes from it.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from shape_cases import CORRUPTIONS, Case, seed_of, success_limit
from shape_family import HALVES, KINDS, kinds_of

from drake_aerial.choices import METHODS
from drake_aerial.contacts.transfer import transfer
from drake_aerial.errors import InputError, JobError

WANTED = ("task", "obb", "registration", "kopicki", "centroid")
_Z = 1.96


def wilson(good: int, count: int) -> tuple[float, float]:
    """Return the 95 % Wilson interval of a share."""
    if count == 0:
        return 0.0, 1.0
    share, z2 = good / count, _Z**2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = _Z * np.sqrt(share * (1 - share) / count + z2 / (4 * count**2)) / (1 + z2 / count)
    return float(middle - half), float(middle + half)


def condition_of(seed: int) -> str:
    """Return the scan's condition of a seed: clean if even, else one corruption in turn."""
    return "clean" if seed % 2 == 0 else CORRUPTIONS[(seed // 2) % len(CORRUPTIONS)]


def cases_of(
    half: str, kinds: list[str] | None, seeds: list[int], condition: str, master: int
) -> list[Case]:
    """Return all cases of a half, kind after kind."""
    chosen = [kind for kind in kinds_of(half) if not kinds or kind.name in kinds]
    return [
        Case(
            kind.name, site, condition_of(seed) if condition == "mixed" else condition, seed, master
        )
        for kind in chosen
        for site in kind.sites
        for seed in seeds
    ]


def measure(case: Case, methods: tuple[str, ...]) -> list[dict]:
    """Return one record per method: distances from the right place [m] of up to five solutions."""
    records = []
    for method in methods:
        start = time.process_time()
        record = {"key": case.key, "kind": case.kind, "site": case.site, "seed": case.seed}
        record |= {"condition": case.condition, "method": method, "size": case.asked.size}
        try:
            skill, (cloud, _) = case.skill, case.scan
            start = time.process_time()
            found = transfer(skill, cloud, method=method, seed=case.seed)
            p_SG = np.array([solution.X_SG.p[0] for solution in found.solutions])
            record["errors"] = [round(float(e), 5) for e in case.errors(p_SG)]
            record["feasible"] = [solution.feasible for solution in found.solutions]
        except (InputError, JobError) as error:
            record |= {"errors": [], "feasible": [], "failure": str(error)[:200]}
        record["cpu_s"] = round(time.process_time() - start, 3)
        records.append(record)
    return records


def read_records(path: Path) -> list[dict]:
    """Return the records of a file of JSON lines; a last line that was cut off is ignored."""
    records = []
    if path.exists():
        for line in path.read_text().splitlines():
            try:
                records.append(json.loads(line))
            except json.JSONDecodeError:
                continue
    return records


def run(cases: list[Case], methods: tuple[str, ...], path: Path, workers: int) -> list[dict]:
    """Measure the cases that the file does not hold yet, append them, and return all of them."""
    known = {(r["key"], r["method"]) for r in read_records(path)}
    jobs = {}
    for case in cases:
        missing = tuple(m for m in methods if (case.key, m) not in known)
        if missing:
            jobs.setdefault(missing, []).append(case)
    total, done = sum(map(len, jobs.values())), 0
    path.parent.mkdir(parents=True, exist_ok=True)
    with multiprocessing.get_context("spawn").Pool(workers) as pool, path.open("a") as file:
        for missing, group in jobs.items():
            for records in pool.imap_unordered(partial(measure, methods=missing), group):
                file.writelines(json.dumps(record) + "\n" for record in records)
                file.flush()
                done += 1
                if done % 20 == 0:
                    print(f"{done} of {total} cases", file=sys.stderr, flush=True)
    wanted = {case.key for case in cases}
    return [r for r in read_records(path) if r["key"] in wanted and r["method"] in methods]


def summary(records: list[dict]) -> dict[str, float]:
    """Return counts and distances of one method: rank 1, best of five, median and p90 [cm]."""
    limit = np.array([success_limit(r["size"]) for r in records])
    first = np.array([r["errors"][0] if r["errors"] else np.inf for r in records])
    five = np.array([min(r["errors"], default=np.inf) for r in records])
    flown = np.array(
        [next((e for e, f in zip(r["errors"], r["feasible"]) if f), np.inf) for r in records]
    )
    finite = np.where(np.isfinite(first), first, 10.0)
    return {
        "count": len(records),
        "rank1": int(np.sum(first <= limit)),
        "best5": int(np.sum(five <= limit)),
        "flown": int(np.sum(flown <= limit)),
        "median": 100.0 * float(np.median(finite)),
        "p90": 100.0 * float(np.quantile(finite, 0.9)),
        "worst": 100.0 * float(finite.max()),
        "five_median": 100.0 * float(np.median(np.where(np.isfinite(five), five, 10.0))),
        "cpu_s": float(np.mean([r["cpu_s"] for r in records])),
    }


def lines(records: list[dict], methods: tuple[str, ...]) -> Iterator[str]:
    """Yield the table: one line per kind and method, then all kinds together."""
    yield (
        f"{'kind':14s} {'method':12s} {'rank 1':>9s} {'best of 5':>9s} {'feasible':>9s} "
        f"{'median':>7s} {'p90':>7s} {'worst':>7s} {'CPU s':>6s}"
    )
    groups = [(name, [r for r in records if r["kind"] == name]) for name in KINDS]
    clean = [r for r in records if r["condition"] == "clean"]
    rest = [r for r in records if r["condition"] != "clean"]
    for name, group in [*groups, ("all clean", clean), ("all others", rest), ("all", records)]:
        for method in methods:
            own = [r for r in group if r["method"] == method]
            if not own:
                continue
            s = summary(own)
            line = f"{name:14s} {method:12s}"
            for part in ("rank1", "best5", "flown"):
                line += f" {s[part]:4d}/{s['count']:<4d}"
            line += "".join(f" {s[part]:7.1f}" for part in ("median", "p90", "worst"))
            line += f" {s['cpu_s']:6.2f}"
            if name.startswith("all"):
                low, high = wilson(int(s["rank1"]), int(s["count"]))
                line += f"  rank 1: {100 * s['rank1'] / s['count']:.1f} %"
                line += f" [{100 * low:.1f}, {100 * high:.1f}]"
                line += f", best of 5: {100 * s['best5'] / s['count']:.1f} %"
            yield line


def commit_hash() -> str:
    """Return the hash of the checked-out commit."""
    at = Path(__file__).parent
    output = subprocess.run(["git", "rev-parse", "HEAD"], cwd=at, capture_output=True, text=True)
    return output.stdout.strip() or "unknown"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--half", choices=HALVES, default="development")
    parser.add_argument("--kinds", nargs="+", help="names of kinds; all of the half by default")
    parser.add_argument("--seeds", default="0-9", help="first-last, both included")
    parser.add_argument("--condition", default="mixed", help="mixed, cut, clean or a corruption")
    parser.add_argument("--methods", nargs="+", default=list(WANTED), help="methods of `transfer`")
    parser.add_argument("--commit", help="hash that fixes the report's seeds (default: HEAD)")
    parser.add_argument("--out", type=Path, help="file of JSON lines (default: by half and commit)")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--table", action="store_true", help="print what the file holds, no runs")
    options = parser.parse_args()
    first, last = (int(part) for part in options.seeds.split("-"))
    commit = options.commit or commit_hash()
    master = 0 if options.half == "development" else seed_of(commit)
    path = options.out or Path(f"held_out_{options.half}_{commit[:7]}.jsonl")
    methods = tuple(m for m in options.methods if m in METHODS)
    absent = [m for m in options.methods if m not in METHODS]
    if absent:
        print(f"not in this checkout: {', '.join(absent)}", file=sys.stderr)
    cases = cases_of(options.half, options.kinds, range(first, last + 1), options.condition, master)
    if options.table:
        keys = {case.key for case in cases}
        records = [r for r in read_records(path) if r["key"] in keys]
    else:
        records = run(cases, methods, path, options.workers)
    print(f"{options.half}, commit {commit[:7]}, {len(cases)} cases, condition {options.condition}")
    print("counts within the larger of 1.5 cm and 5 % of the size; distances of rank 1 in cm")
    print("\n".join(lines(records, methods)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
