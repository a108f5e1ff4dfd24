from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.contacts.feasibility.reasons import Reason
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.geometry import Pose
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.study.conditions import Condition
from drake_aerial.study.plan import Arm
from drake_aerial.study.trial_tasks import plan_trials
from drake_aerial.study.trials import fly_trial

BOX = Condition(
    "A",
    "box_68x61x28",
    demonstration="flat",
    points=2000,
    trajectory=HoverTrajectory(hover_time=0.3),
)
CLOUD = {"path": None, "centroid": [0.0, 0.0, 0.14], "up": [0.0, 0.0, 1.0]}
LEVEL = np.array([[1.0, 0.0, 0.0, 0.0]])


def solutions(*verdicts):
    """Return solutions along the box's top, one for every tuple of reasons."""
    found = []
    for k, reasons in enumerate(verdicts):
        p = np.array([[0.02 * k, 0.0, 0.14]])
        up = np.array([[0.0, 0.0, 1.0]])
        found.append(
            Solution(
                k + 1,
                -float(k),
                not reasons,
                tuple(map(Reason.from_text, reasons)),
                Pose(p, LEVEL),
                up,
                Pose(p + 0.5 * up, LEVEL),
            )
        )
    return ContactSolutions("task", 0, "flat", CLOUD, {}, tuple(found))


def trials(contacts, arm=None, failure=None, fly_infeasible=False, seed=0, fingerprint="f"):
    arm = Arm(BOX, "task", "true", "table", 2, 3) if arm is None else arm
    return plan_trials(
        arm, contacts, failure, seed=seed, fingerprint=fingerprint, fly_infeasible=fly_infeasible
    )


def test_the_best_feasible_solutions_are_flown_and_better_infeasible_ones_recorded():
    contacts = solutions((), ("upside down",), (), ("cable through the payload",), ())
    tasks = trials(contacts)
    assert [(t.solution, t.rank, t.trial) for t in tasks] == [
        *((1, 1, k) for k in range(3)),
        (None, 2, 0),
        *((2, 3, k) for k in range(3)),
    ]
    everything = trials(contacts, fly_infeasible=True)
    assert [(t.solution, t.rank, t.trial) for t in everything] == [
        (s, s, k) for s in (1, 2) for k in range(3)
    ]


def test_keys_follow_everything_a_result_depends_on_and_nothing_else():
    contacts, arm = solutions(()), Arm(BOX, "task", "true", "table", 1, 2)
    keys = [t.key for t in trials(contacts, arm)]
    assert len(set(keys)) == 2
    # More trials or solutions leave the keys of the first ones alone, and so does a title.
    assert [t.key for t in trials(contacts, replace(arm, trials=5, solutions=3))][:2] == keys
    assert [
        t.key for t in trials(contacts, replace(arm, condition=replace(BOX, title="x")))
    ] == keys
    others = [
        trials(contacts, arm, seed=1),
        trials(contacts, arm, fingerprint="g"),
        trials(contacts, replace(arm, belief="geometric")),
        trials(contacts, replace(arm, inertia="mesh")),
        trials(contacts, replace(arm, method="paper")),
        trials(contacts, replace(arm, condition=replace(BOX, flight_noise=0.02))),
    ]
    assert not {t.key for tasks in others for t in tasks} & set(keys)


def test_the_record_of_an_infeasible_solution_has_the_reason():
    task = trials(solutions(("upside down",), ()))[0]
    flown = fly_trial(task)
    assert flown.series == {}
    record = flown.record
    assert (record["outcome"], record["outcome_reason"]) == ("not_flown", "upside down")
    assert (record["feasible"], record["reasons"], record["solution"], record["rank"]) == (
        False,
        ["upside down"],
        None,
        1,
    )
    assert record["metrics"] is None


def test_a_failed_transfer_is_one_record():
    (task,) = trials(None, failure="no votes")
    record = fly_trial(task).record
    assert (record["outcome"], record["outcome_reason"], record["rank"]) == (
        "not_flown",
        "no votes",
        None,
    )


def test_a_trial_is_a_record_and_its_series():
    first, second, _ = trials(solutions(()), Arm(BOX, "task", "true", "mesh", 1, 3))
    flown, later = fly_trial(first), fly_trial(second)
    record = flown.record
    assert record["outcome"] == "completed"
    assert record["contact"]["positions_S"] == [[0.0, 0.0, 0.14]]
    assert record["contact"]["off_com_m"] == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < record["metrics"]["position_rmse_m"] < 0.01
    assert all(value is None or isinstance(value, float) for value in record["metrics"].values())
    # One diagram for both, and no trace of the first in the second.
    assert later.diagrams == flown.diagrams
    assert later.record["metrics"] != record["metrics"]
    again = fly_trial(first)
    assert again.record["metrics"] == record["metrics"]
    series = flown.series
    assert series["moment"].shape == (len(series["time"]), 1, 3)
    assert np.diff(series["time"]) == pytest.approx(0.05)
    # The whole flight is scored; the series has every fifth sample of it.
    rms = float(np.sqrt(np.mean(series["position_error"].astype(float) ** 2)))
    assert rms == pytest.approx(record["metrics"]["position_rmse_m"], rel=0.3)


def test_trials_are_paired_by_their_number():
    a = trials(solutions(()), Arm(BOX, "task", "true", "table", 1, 2))
    b = trials(solutions(()), Arm(replace(BOX, name="B"), "paper", "below_contact", "mesh", 1, 2))
    assert [fly_trial(t).record["seed"] for t in a] == [fly_trial(t).record["seed"] for t in b]
    assert fly_trial(a[0]).record["seed"] != fly_trial(a[1]).record["seed"]
