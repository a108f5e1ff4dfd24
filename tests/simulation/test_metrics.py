"""Metrics of synthetic series whose values are known."""

import numpy as np
import pytest

from drake_aerial.simulation.metrics import flight_metrics

NAMES = ("ground", "tensioning", "lifting", "approach", "circle", "hover")


def synthetic(names=NAMES, count=600):
    T = count
    phase = np.repeat(np.arange(len(names)), T // len(names))
    T = len(phase)
    zeros = np.zeros((T, 3))
    return {
        "time": 0.01 * np.arange(T),
        "phase": phase,
        "payload_position": zeros.copy(),
        "payload_velocity": zeros.copy(),
        "reference_position": zeros,
        "reference_velocity": zeros,
        "attitude_error": np.zeros(T),
        "tilt": np.zeros(T),
        "tension": np.full((T, 2), 1.2),
        "thrust": np.full((T, 2), 4.0),
        "moment": np.zeros((T, 2, 3)),
        "saturated": np.zeros((T, 2), dtype=bool),
    }


def test_errors_are_scored_over_circle_and_hover_alone():
    s = synthetic()
    s["payload_position"][s["phase"] < 4] = 9.0
    s["payload_position"][s["phase"] == 4] = [0.03, 0.0, 0.04]
    s["payload_velocity"][s["phase"] == 5] = [0.0, 0.2, 0.0]
    s["tilt"][s["phase"] == 5] = 0.5
    m = flight_metrics(s, NAMES, 2.45)
    assert m["position_rmse_m"] == pytest.approx(0.05 / np.sqrt(2))
    assert m["circle_position_rmse_m"] == pytest.approx(0.05)
    assert m["position_max_m"] == pytest.approx(0.05)
    assert m["velocity_rmse_m_s"] == pytest.approx(0.2 / np.sqrt(2))
    assert (m["tilt_mean_rad"], m["tilt_max_rad"]) == pytest.approx((0.25, 0.5))


def test_slack_saturation_thrust_and_phases():
    s = synthetic()
    s["tension"][s["phase"] == 2, 0] = 0.01
    s["tension"][s["phase"] == 5, 1] = 3.0
    s["tension"][s["phase"] == 0] = 0.0
    s["saturated"][s["phase"] == 1] = True
    s["moment"][s["phase"] >= 4] = [0.3, 0.0, 0.4]
    m = flight_metrics(s, NAMES, 2.45)
    assert m["slack_fraction"] == pytest.approx(1 / 8)
    assert m["saturated_fraction"] == pytest.approx(1 / 5)
    assert m["tension_max_N"] == 3.0
    assert m["moment_rms_N_m"] == pytest.approx(0.5)
    assert m["phases"]["circle"] == pytest.approx([4.0, 4.99])
    assert list(m["phases"]) == list(NAMES)


def test_a_flight_that_ended_early_has_no_scores():
    s = synthetic()
    early = {key: value[:150] for key, value in s.items()}
    m = flight_metrics(early, NAMES, 2.45)
    assert m["position_rmse_m"] is None
    assert m["circle_position_rmse_m"] is None
    assert set(m["phases"]) == {"ground", "tensioning"}


def test_without_a_circle_all_phases_after_the_lift_are_scored():
    names = (*NAMES[:3], "line", "hover")
    s = synthetic(names)
    s["payload_position"][s["phase"] == 3] = [0.0, 0.1, 0.0]
    m = flight_metrics(s, names, 2.45)
    assert m["position_rmse_m"] == pytest.approx(0.1 / np.sqrt(2))
    assert m["circle_position_rmse_m"] is None
