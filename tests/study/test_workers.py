import os
import sys
from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from drake_aerial import InputError
from drake_aerial.study import workers
from drake_aerial.study.workers import ThisProcess, _Queue, default_workers, hired


@dataclass(frozen=True)
class Chore:
    group: str
    number: int = 0

    @property
    def name(self):
        return f"{self.group}{self.number}"


def test_a_worker_stays_with_its_group_and_takes_a_free_one_next():
    queue = _Queue([Chore(g, k) for g in "abc" for k in range(2)])
    taken = [queue.next(address).name for address in ("one", "two", "two", "one", "one", "two")]
    assert taken == ["a0", "b0", "b1", "a1", "c0", "c1"]
    assert not queue


def test_the_last_group_is_shared():
    queue = _Queue([Chore("a", k) for k in range(3)])
    assert [queue.next(address).name for address in ("one", "two", "three")] == ["a0", "a1", "a2"]


def test_this_process_goes_on_after_an_error():
    def divide(chore):
        return 6 // chore.number

    done = [
        (chore.number, result)
        for chore, result in ThisProcess().run(divide, [Chore("a", k) for k in (2, 0, 3)])
    ]
    assert done[0] == (2, 3)
    assert isinstance(done[1][1], ZeroDivisionError)
    assert done[2] == (3, 2)


def test_a_cluster_returns_errors_and_replaces_workers_that_have_built_enough(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "DIAGRAMS_PER_WORKER", 2)

    # Sent by value: the workers do not have this file.
    def work(chore):
        if chore.number == 1:
            raise ZeroDivisionError("a defect")
        return SimpleNamespace(
            pid=os.getpid(), threads=os.environ["OMP_NUM_THREADS"], diagrams=chore.number
        )

    work.__module__ = "__main__"
    with hired(workers=1) as staff:
        chores = [SimpleNamespace(group="a", name="", number=k) for k in (0, 1, 2, 0)]
        results = [result for _, result in staff.run(work, chores)]
    assert isinstance(results[1], ZeroDivisionError)
    assert results[0].pid == results[2].pid
    assert results[3].pid != results[2].pid
    assert os.getpid() not in {results[k].pid for k in (0, 2, 3)}
    assert results[0].threads == "1"


def test_without_dask_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"drake-aerial\[study\]"), hired(workers=2):
        pass
    with hired(workers=0) as staff:
        assert isinstance(staff, ThisProcess)


def test_default_workers_are_the_cores(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2}, raising=False)
    pytest.importorskip("distributed")
    assert default_workers() == 3
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    assert default_workers() == 0
