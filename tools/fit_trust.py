"""Fit the model of the trust in contacts, and write its data file.

    tools/run python tools/fit_trust.py --pairs 300 --records trust_development.jsonl
    tools/run python tools/fit_trust.py --pairs 300 --records trust_development.jsonl --write

Cases are drawn from the development half of the generated kinds (tools/bench/shape_family.py):
right and wrong skills, moved parts, corrupted, cut and partial scans. Each transfer is recorded
with the evidence about its solutions, as JSON lines; an interrupted run resumes. The weights are a
logistic regression with a ridge. Its log-odds are then corrected by a monotone line on answers
that were held out, a kind at a time. `--write` replaces the package's data file.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

BENCH = Path(__file__).parent / "bench"
sys.path.insert(0, str(BENCH))

from trust import Table, record_answers, report
from trust_scores import balanced, isotonic

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.trust.trust_model import TrustModel

DATA = Path(__file__).parents[1] / "drake_aerial/contacts/trust/trust_model.json"
# Strength of the ridge, chosen on development kinds that were held out.
RIDGE = 10.0
# Probabilities stay this far from 0 and 1.
_MARGIN = 0.01


def logistic(
    x: np.ndarray, right: np.ndarray, weight: np.ndarray, ridge: float
) -> tuple[float, np.ndarray]:
    """Return intercept and weights of a ridge logistic regression, by Newton's method."""
    mean, deviation = x.mean(axis=0), x.std(axis=0) + 1e-9
    z = np.column_stack([np.ones(len(x)), (x - mean) / deviation])
    weight = weight * len(x) / weight.sum()
    penalty = np.diag([0.0] + [ridge] * x.shape[1])
    beta = np.zeros(z.shape[1])
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-np.clip(z @ beta, -30.0, 30.0)))
        slope = z.T @ (weight * (right - p)) - penalty @ beta
        curvature = (z * (weight * p * (1.0 - p))[:, None]).T @ z + penalty
        curvature += 1e-9 * np.eye(len(beta))
        step = np.linalg.solve(curvature, slope)
        beta += step
        if np.abs(step).max() < 1e-8:
            break
    return float(beta[0] - np.sum(beta[1:] * mean / deviation)), beta[1:] / deviation


def held_out_log_odds(table: Table, ridge: float = RIDGE) -> np.ndarray:
    """Return log-odds of each row by a fit without its kind and without the kind of its skill."""
    log_odds = np.zeros(len(table.x))
    for kind in np.unique(table.kind):
        own = table.kind == kind
        rest = ~own & (table.taught_kind != kind)
        intercept, weights = logistic(table.x[rest], table.right[rest], table.weight[rest], ridge)
        log_odds[own] = intercept + table.x[own] @ weights
    return log_odds


def correction(
    log_odds: np.ndarray, right: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return at most 12 points of a monotone line from log-odds to probabilities."""
    x, p = isotonic(log_odds, right.astype(float), weight)
    grid = np.interp(np.linspace(0.0, 1.0, 12), np.linspace(0.0, 1.0, len(x)), x)
    smooth = np.interp(grid, x, p)
    return grid, np.clip(smooth, _MARGIN, 1.0 - _MARGIN)


def fit(table: Table, provenance: dict) -> tuple[TrustModel, np.ndarray]:
    """Return the model, and the rows' held-out probabilities with its correction."""
    held_out = held_out_log_odds(table)
    first = table.rank == 0
    points = correction(held_out[first], table.right[first], balanced(table.right[first]))
    intercept, weights = logistic(table.x, table.right, table.weight, RIDGE)
    model = TrustModel(
        round(intercept, 6),
        {name: round(float(w), 6) for name, w in zip(table.names, weights, strict=True)},
        np.round(points[0], 4),
        np.round(points[1], 4),
        provenance,
    )
    return model, np.interp(held_out, *points)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--records", type=Path, required=True, help="file of JSON lines")
    parser.add_argument("--pairs", type=int, default=300, help="pairs of cases, 4 answers each")
    parser.add_argument("--master", type=int, default=17, help="seed of all cases")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--write", action="store_true", help="replace the package's data file")
    options = parser.parse_args()
    records = record_answers(
        options.records, "development", options.pairs, options.master, options.workers
    )
    table = Table(records)
    at = {"cwd": BENCH, "capture_output": True, "text": True}
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], **at).stdout.strip()
    model, held_out = fit(
        table,
        {
            "script": "tools/fit_trust.py",
            "commit": commit,
            "half": "development",
            "master_seed": options.master,
            "answers": int((table.rank == 0).sum()),
            "right": int(table.right[table.rank == 0].sum()),
        },
    )
    print("held out, a kind at a time:")
    print("\n".join(report(table, held_out, TransferParameters().min_trust)))
    scale = table.x.std(axis=0)
    for name, s in sorted(zip(table.names, scale, strict=True), key=lambda entry: entry[0]):
        print(f"  {name:18s} {model.weights[name] * s:+.2f} per standard deviation")
    if options.write:
        DATA.write_text(json.dumps(model.to_dict(), indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
