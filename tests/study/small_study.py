"""A synthetic study folder with known errors, for tests of the report."""

import json

import numpy as np
import yaml

METRICS = {
    "velocity_rmse_m_s": 2.0,
    "position_max_m": 2.5,
    "tilt_mean_rad": 3.0,
    "tilt_max_rad": 6.0,
    "attitude_rmse_rad": 4.0,
    "moment_rms_N_m": 0.05,
}


def record(
    condition,
    method,
    solution,
    trial,
    rmse,
    *,
    belief="below_contact",
    inertia="table",
    outcome="completed",
    offset=0.1,
):
    """Return a record; every error is a multiple of the position error."""
    flew = outcome != "not_flown"
    metrics = {key: factor * rmse for key, factor in METRICS.items()} if flew else None
    if metrics is not None:
        metrics |= {
            "position_rmse_m": rmse,
            "thrust_mean_N": 4.9 + rmse,
            "thrust_max_N": 6.0,
            "tension_max_N": 3.0,
        }
        metrics |= {"slack_fraction": 0.0, "saturated_fraction": 0.0}
    return {
        "schema": "drake_aerial/study_record",
        "version": 1,
        "key": f"{condition}{method}{belief}{inertia}{solution}{trial}".encode().hex()[-24:]
        + f"{abs(hash_of(condition, method, belief)):06x}",
        "condition": condition,
        "method": method,
        "belief": belief,
        "inertia": inertia,
        "solution": solution if flew else None,
        "rank": solution,
        "trial": trial,
        "seed": 100 + trial,
        "feasible": flew,
        "reasons": [] if flew else ["upside down"],
        "moved_m": [0.0],
        "contact": {
            "centre_S": [offset, 0.0, 0.1],
            "positions_S": [[offset, 0.0, 0.1]],
            "com_S": [0.0, 0.0, 0.0],
            "off_com_m": offset,
        },
        "outcome": outcome,
        "outcome_reason": None if outcome == "completed" else "made up",
        "outcome_time_s": None,
        "metrics": metrics,
        "timing": {"wall_s": 2.0, "cpu_s": 1.5},
    }


def hash_of(*names):
    return sum((i + 1) * ord(c) for i, c in enumerate("/".join(names)))


def write_study(folder, records, *, conditions=(), series=True, order=None):
    """Write the folder of a study; `order` permutes the lines of its records."""
    (folder / "series").mkdir(parents=True)
    lines = [json.dumps(r) for r in records]
    if order is not None:
        lines = [lines[k] for k in order]
    (folder / "records.jsonl").write_text("\n".join(lines) + "\n")
    plan = {"name": "made up", "seed": 0, "package_version": "0", "conditions": list(conditions)}
    (folder / "study.yaml").write_text(yaml.safe_dump(plan, sort_keys=False))
    for r in records:
        if series and r["outcome"] != "not_flown":
            np.savez_compressed(folder / "series" / f"{r['key']}.npz", **series_of(r))


def series_of(r, quadrotors=1):
    time = np.arange(0.0, 20.0, 0.05)
    rng = np.random.default_rng(hash_of(r["key"]))
    error = r["metrics"]["position_rmse_m"] * (1.0 + 0.1 * np.sin(time + rng.uniform(0, 6)))
    phase = np.select([time < 0.5, time < 1.0, time < 3.0, time < 15.0], [0, 1, 2, 3], 4)
    moment = np.zeros((len(time), quadrotors, 3))
    moment[..., 0] = 0.05 * error[:, None]
    return {
        "time": time.astype(np.float32),
        "phase": phase,
        "position_error": error,
        "velocity_error": 2.0 * error,
        "attitude_error": 4.0 * error,
        "tilt": 3.0 * error,
        "thrust": np.tile(4.9 + error[:, None], (1, quadrotors)),
        "moment": moment,
        "tension": np.full((len(time), quadrotors), 2.4),
    }


def method_study(rng, *, conditions=("A", "B"), solutions=5, trials=4, ratio=3.0):
    """Return records with errors of `kopicki` `ratio` times those of `task`, and a crash of it."""
    records = []
    for condition in conditions:
        for method, level in (("task", 0.02), ("kopicki", 0.02 * ratio)):
            for solution in range(1, solutions + 1):
                contact = level * rng.uniform(0.8, 1.2)
                for trial in range(trials):
                    crashed = method == "kopicki" and solution == 2 and trial == 0
                    rmse = contact * rng.uniform(0.95, 1.05)
                    outcome = "crashed" if crashed else "completed"
                    records.append(
                        record(
                            condition,
                            method,
                            solution,
                            trial,
                            rmse,
                            outcome=outcome,
                            offset=contact * 4,
                        )
                    )
    return records
