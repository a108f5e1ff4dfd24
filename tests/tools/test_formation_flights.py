"""The bench of formation flights: its verdicts on made-up figures, and its rows."""

import sys
from pathlib import Path

import numpy as np
import pytest

from drake_aerial.simulation.flight_options import FlightOptions


@pytest.fixture(scope="module")
def bench():
    sys.path.insert(0, str(Path(__file__).parents[2] / "tools" / "bench"))
    try:
        import formation_flights
    finally:
        sys.path.pop(0)
    return formation_flights


def figures(**changes):
    good = {name: np.array([0.3, 0.35]) for name in ("rmse", "circle", "hover", "attitude", "peak")}
    return {**good, "completed": 1.0, "step_ms": 3.0, "speed": 5.0, **changes}


def test_figures_within_their_bounds_are_ok_and_targets_of_rows_not_flown_are_left_out(bench):
    lines = list(bench.judge({"mpc": figures()}))
    assert len(lines) == 5
    assert all(good and line.endswith("ok") for line, good in lines)
    assert not list(bench.judge({}))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("circle", np.array([0.3, 0.71])),  # the mean would do; the worst seed counts
        ("hover", np.array([0.41, 0.1])),
        ("attitude", np.array([0.1, 0.6])),
        ("step_ms", 4.1),
        ("speed", 3.9),
        ("step_ms", float("nan")),
    ],
)
def test_one_figure_out_of_bounds_is_one_miss(bench, name, value):
    lines = list(bench.judge({"mpc": figures(**{name: value})}))
    missed = [line for line, good in lines if not good]
    assert len(missed) == 1
    assert missed[0].endswith("MISS")


def test_a_flight_that_did_not_end_well_misses_every_target_of_its_row(bench):
    assert not any(good for _, good in bench.judge({"mpc": figures(completed=0.9)}))


def test_the_kinds_of_cable_are_compared_seed_by_seed(bench):
    def differ(rmse):
        lines = bench.judge({"mpc": figures(), "mpc, elastic": figures(rmse=np.array(rmse))})
        return [good for line, good in lines if "kinds differ" in line]

    assert differ([0.39, 0.26]) == [True]
    assert differ([0.3, 0.46]) == [False]


def test_the_published_run_has_a_lower_bound_too(bench):
    def good(circle, peak):
        row = figures(circle=np.array([circle]), peak=np.array([peak]))
        return [good for _, good in bench.judge({"geometric, constant rate": row})]

    assert good(13.8, 48.1) == [True, True]
    assert good(13.4, 47.4) == [False, False]


def test_every_target_has_its_row_and_labels_are_unique(bench):
    labels = [row.label for row in bench.ROWS]
    assert len(set(labels)) == len(labels)
    for target in bench.TARGETS:
        assert {target.row, target.other} - {""} <= set(labels)
    assert all(isinstance(row.options, FlightOptions) for row in bench.ROWS)
