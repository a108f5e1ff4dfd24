"""Work spread over cores: every item once, errors told, nesting allowed."""

import threading
import time

import pytest

from drake_aerial.parallel import cores, for_each


@pytest.fixture(params=["1", "2", "5"])
def some_cores(request, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", request.param)
    return int(request.param)


def test_every_item_is_done_once(some_cores):
    done, lock = [], threading.Lock()

    def do(item):
        with lock:
            done.append(item)

    for_each(do, range(100))
    assert sorted(done) == list(range(100))


def test_several_are_under_way_at_once(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    met = threading.Barrier(2, timeout=10.0)
    for_each(lambda _: met.wait(), range(2))


def test_an_error_is_raised_and_nothing_more_begun(some_cores):
    done = []

    def do(item):
        if item == 3:
            raise KeyError(item)
        time.sleep(0.001)
        done.append(item)

    with pytest.raises(KeyError, match="3"):
        for_each(do, range(1000))
    assert len(done) < 500


def test_an_item_may_itself_be_spread(some_cores):
    done = []
    for_each(lambda i: for_each(lambda j: done.append((i, j)), range(4)), range(6))
    assert sorted(done) == [(i, j) for i in range(6) for j in range(4)]


@pytest.mark.parametrize(("value", "number"), [("3", 3), ("4,2", 4), (" 2 ", 2)])
def test_the_environment_says_how_many(monkeypatch, value, number):
    monkeypatch.setenv("OMP_NUM_THREADS", value)
    assert cores() == number


@pytest.mark.parametrize("value", ["", "0", "-1", "many"])
def test_an_environment_that_says_nothing_leaves_the_machine_s(monkeypatch, value):
    monkeypatch.setenv("OMP_NUM_THREADS", value)
    asked = cores()
    monkeypatch.delenv("OMP_NUM_THREADS")
    assert asked == cores() >= 1
