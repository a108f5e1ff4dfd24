"""Plots beside a replay keep every peak, and their cursor shows the right numbers."""

import json
import re

import numpy as np
import pytest

from drake_aerial.visualization.svg_time_plots import TimePlot, svg_time_plots


def lines_of(page):
    return [
        np.array([pair.split(",") for pair in points.split()], float)
        for points in re.findall(r'<polyline points="([^"]+)"', page)
    ]


def test_a_peak_of_one_sample_is_drawn_at_its_time_and_height():
    time = 0.01 * np.arange(30_000)
    values = np.ones((30_000, 1))
    values[17_123] = 6.0
    page = svg_time_plots(time, [TimePlot("tension [N]", values)])
    (line,) = lines_of(page)
    assert len(line) < 1000
    # The scale ends at the next round number, 7.
    assert line[:, 1].min() == pytest.approx(100 * (1 - 6 / 7), abs=0.06)
    assert line[line[:, 1].argmin(), 0] == pytest.approx(1000 * 17_123 / 29_999, abs=0.06)
    assert line[[0, -1], 0].tolist() == [0.0, 1000.0]
    assert ">7<" in page


def test_the_cursor_reads_every_line_ten_times_a_second():
    time = 0.01 * np.arange(501)
    values = np.column_stack([time, 2.0 * time])
    page = svg_time_plots(time, [TimePlot("a [m]", values), TimePlot("b & c", values[:, :1])])
    data = json.loads(re.search(r"const data = (.*);", page).group(1))
    assert data["span"] == pytest.approx(5.0)
    for t in (0.0, 1.3, 5.0):
        assert data["values"][0][round(t / data["period"])] == pytest.approx([t, 2 * t])
    assert "b &amp; c" in page
    assert [len(rows[0]) for rows in data["values"]] == [2, 1]


def test_marks_are_drawn_inside_only():
    page = svg_time_plots(
        np.linspace(2.0, 12.0, 101), [TimePlot("a", np.ones(101))], [2.0, 7.0, 13.0]
    )
    assert re.findall(r'class="mark" x1="([^"]+)"', page) == ["500.0"]


def test_nan_and_all_zero_values_are_drawn_as_zero():
    page = svg_time_plots(np.arange(3.0), [TimePlot("a", np.array([0.0, np.nan, 0.0]))])
    assert lines_of(page)[0][:, 1].tolist() == [100.0, 100.0, 100.0]


def test_one_sample_gives_no_plot():
    assert svg_time_plots(np.zeros(1), [TimePlot("a", np.zeros(1))]) == ""
