"""The example of an own controller is short, and the bar ends where statics predicts."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "two_quadrotors_and_a_bar.py"


def test_it_is_under_forty_lines_of_code():
    lines = [line.strip() for line in EXAMPLE.read_text().splitlines()]
    assert 0 < len([line for line in lines if line and not line.startswith("#")]) < 40


def test_the_bar_ends_where_the_springs_hold_the_weight():
    state = runpy.run_path(str(EXAMPLE))["main"]()
    # Each quadrotor carries itself, its cable's link and half of bar and grippers. The thrust is
    # 3.9 N; the spring of 6 N/m supplies the rest.
    weight = 9.81 * (0.25 + 2e-4 + (0.3 + 2 * 0.002) / 2)
    height = 2.0 - (weight - 3.9) / 6.0 - 0.5 - 0.03
    assert state[4:7] == pytest.approx([0.0, 0.0, height], abs=2e-3)
    assert np.abs(state[1:4]).max() < 0.01
    assert np.abs(state[7:]).max() < 0.01


def test_it_runs_as_a_program():
    done = subprocess.run(
        [sys.executable, str(EXAMPLE)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ},
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("the bar is at [")
