"""Random stations, also absurd ones: each ends with an outcome or a one-line error."""

import importlib.util
from collections import Counter
from pathlib import Path

import pytest

from drake_aerial.simulation.outcome import OUTCOMES


@pytest.fixture(scope="module")
def bench():
    path = Path(__file__).parents[2] / "tools" / "bench" / "random_stations.py"
    spec = importlib.util.spec_from_file_location("random_stations", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def ends(bench, numbers):
    results = [bench.run(number) for number in numbers]
    wrong = [result for result in results if result["ended"] not in (*OUTCOMES, "refused")]
    assert wrong == []
    assert all(result["why"] or result["ended"] == "completed" for result in results)
    return Counter(result["ended"] for result in results)


def test_a_few_random_stations(bench):
    assert sum(ends(bench, range(5000, 5012)).values()) == 12


@pytest.mark.fuzz
def test_random_stations(bench):
    counts = ends(bench, range(6000, 6100))
    # The draw is wide enough to see every end that there is.
    assert set(counts) == {*OUTCOMES, "refused"}
