"""How well the trust in contacts tells right answers from wrong ones.

    python tools/bench/trust.py --half report --pairs 150 --records trust_report.jsonl

Two kinds of generated objects make a pair: each skill is asked on both scans, so that half of the
questions have a wrong skill. Scans are clean, corrupted, views of one camera, or cut; a cut takes
38 % of the object away and leaves the site. An answer is right within 5 % of the object's size (at
least 1 cm). Scores weight right and wrong answers equally. The report's seeds follow from the
commit's hash, and its first run counts. Records are kept as JSON lines; a run resumes from them.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
from pathlib import Path

import numpy as np
from held_out_shapes import commit_hash
from shape_cases import seed_of
from shape_family import HALVES
from trust_cases import SCANS, answers, pairs, right_within
from trust_scores import auc, balanced, brier, calibration_error

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.trust.evidence import Evidence
from drake_aerial.contacts.trust.trust_model import TrustModel, terms_of

# Weight of solutions of lower rank against those of rank 1 in a fit, and how many ranks count.
_LOWER_WEIGHT, _RANKS = 0.25, 3
# Terms that are not fitted: the scale of log J changes with the method's search and experts, and a
# model with them trusted 62 % of wrong skills after such a change.
_LEFT_OUT = ("gap", "gap_distance")


def record_answers(
    path: Path, half: str, count: int, master: int, workers: int, cut_only: bool = False
) -> list[dict]:
    """Append the answers of the pairs that the file does not hold yet, and return all of them."""
    known = {record["pair"] for record in read(path)}
    todo = [
        pair
        for pair in pairs(half, count, master, ("cut",) if cut_only else SCANS)
        if pair.key not in known
    ]
    with multiprocessing.get_context("spawn").Pool(workers) as pool, path.open("a") as file:
        for done, records in enumerate(pool.imap_unordered(answers, todo), 1):
            file.writelines(json.dumps(record) + "\n" for record in records)
            file.flush()
            if done % 10 == 0:
                print(f"{done} of {len(todo)} pairs", file=sys.stderr, flush=True)
    return read(path)


def read(path: Path) -> list[dict]:
    """Return the records of a file of JSON lines, without a line that was cut off."""
    records = []
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            records.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return records


class Table:
    """The answers as arrays: one row per solution of the first ranks."""

    def __init__(self, records: list[dict]):
        rows = [
            (record, rank)
            for record in records
            for rank in range(min(len(record["errors"]), _RANKS))
        ]
        terms = [terms_of(Evidence(**record["evidence"][rank])) for record, rank in rows]
        self.names = [name for name in terms[0] if name not in _LEFT_OUT]
        self.x = np.array([[term[name] for name in self.names] for term in terms])
        self.rank = np.array([rank for _, rank in rows])
        self.right_skill = np.array([record["right_skill"] for record, _ in rows])
        near = [record["errors"][rank] <= right_within(record["size"]) for record, rank in rows]
        self.right = self.right_skill & np.array(near)
        self.kind = np.array([record["kind"] for record, _ in rows])
        self.taught_kind = np.array([record["skill"].split()[0] for record, _ in rows])
        self.condition = np.array([record["condition"] for record, _ in rows])
        self.error = np.array([record["errors"][rank] for record, rank in rows])
        self.weight = np.where(self.rank == 0, 1.0, _LOWER_WEIGHT) * balanced(self.right)


def report(table: Table, probability: np.ndarray, least: float) -> list[str]:
    """Return lines with the scores of the first ranks."""
    first = table.rank == 0
    right, p = table.right[first], probability[first]
    weight = balanced(right)
    wrong_skill = ~table.right_skill[first]
    wrong_place = ~wrong_skill & ~right
    cut = table.condition[first] == "cut"
    far = cut & ~wrong_skill & (table.error[first] > 0.05) & ~right
    return [
        f"answers {first.sum()}: right {right.sum()}, wrong skill {wrong_skill.sum()}, "
        f"wrong place {wrong_place.sum()}",
        f"Brier {brier(p, right, weight):.3f}, "
        f"calibration error {calibration_error(p, right, weight):.3f}",
        f"AUC of wrong skills {auc(p[right], p[wrong_skill]):.3f}, "
        f"of wrong places {auc(p[right], p[wrong_place]):.3f}",
        f"kept at {least:g}: right {np.mean(p[right] >= least):.3f}, "
        f"wrong skills {np.mean(p[wrong_skill] >= least):.3f}, "
        f"wrong places {np.mean(p[wrong_place] >= least):.3f}",
        f"cut: right kept {np.sum(p[cut & right] >= least)}/{np.sum(cut & right)}, "
        f"off by over 5 cm refused {np.sum(p[far] < least)}/{far.sum()}",
    ]


def shipped_probability(records: list[dict]) -> np.ndarray:
    """Return the shipped model's probability of each row of the table of the records."""
    model = TrustModel.shipped()
    return np.array(
        [
            model.probability_of(Evidence(**record["evidence"][rank]))
            for record in records
            for rank in range(min(len(record["errors"]), _RANKS))
        ]
    )


def calibration_lines(table: Table, probability: np.ndarray) -> list[str]:
    """Return one line per fifth of the probability: share that is right, balanced."""
    first = table.rank == 0
    right, p = table.right[first], probability[first]
    weight = balanced(right)
    lines = []
    for low in np.arange(0.0, 1.0, 0.2):
        own = (p >= low) & ((p < low + 0.2) | (low > 0.7))
        if own.any():
            share = np.average(right[own], weights=weight[own])
            lines.append(f"trust {low:.1f} to {low + 0.2:.1f}: {own.sum():4d} answers, {share:.2f}")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--half", choices=HALVES, default="development")
    parser.add_argument("--pairs", type=int, default=100, help="pairs of cases, 4 answers each")
    parser.add_argument("--cut-only", action="store_true", help="only scans that are cut")
    parser.add_argument("--commit", help="hash that fixes the report's seeds (default: HEAD)")
    parser.add_argument("--records", type=Path, required=True, help="file of JSON lines")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    commit = options.commit or commit_hash()
    master = 1 if options.half == "development" else seed_of(commit)
    records = record_answers(
        options.records, options.half, options.pairs, master, options.workers, options.cut_only
    )
    table, probability = Table(records), shipped_probability(records)
    failed = sum(not record["errors"] for record in records)
    print(f"{options.half}, commit {commit[:7]}: {len(records)} questions, {failed} without answer")
    print("\n".join(report(table, probability, TransferParameters().min_trust)))
    print("\n".join(calibration_lines(table, probability)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
