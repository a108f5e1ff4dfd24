import os
import sys
from types import SimpleNamespace

import pytest

from drake_aerial import InputError
from drake_aerial.study import executors
from drake_aerial.study.executors import InProcessExecutor, default_workers, open_executor


def test_this_process_goes_on_after_an_error():
    done = list(InProcessExecutor().run(lambda number: 6 // number, [2, 0, 3]))
    assert done[0] == (2, 3)
    assert isinstance(done[1][1], ZeroDivisionError)
    assert done[2] == (3, 2)


def test_a_cluster_returns_errors_and_restarts_workers_that_have_built_many_diagrams(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(executors, "DIAGRAMS_PER_WORKER", 2)

    # Sent by value: the workers do not have this file.
    def work(number):
        if number == 1:
            raise ZeroDivisionError("a defect")
        return SimpleNamespace(
            pid=os.getpid(), threads=os.environ["OMP_NUM_THREADS"], diagrams=number
        )

    work.__module__ = "__main__"
    with open_executor(workers=1) as executor:
        results = [result for _, result in executor.run(work, [0, 1, 2, 0])]
    assert isinstance(results[1], ZeroDivisionError)
    assert results[0].pid == results[2].pid
    assert results[3].pid != results[2].pid
    assert os.getpid() not in {results[k].pid for k in (0, 2, 3)}
    assert results[0].threads == "1"


def test_a_cluster_runs_a_task_a_worker_at_a_time():
    pytest.importorskip("distributed")

    def work(number):
        import time

        began = time.time()
        time.sleep(0.3)
        return os.getpid(), began, time.time()

    work.__module__ = "__main__"
    with open_executor(workers=2) as executor:
        results = [result for _, result in executor.run(work, list(range(6)))]
    by_worker = {}
    for pid, began, ended in sorted(results, key=lambda result: result[1]):
        assert began >= by_worker.get(pid, 0.0)
        by_worker[pid] = ended
    assert len(by_worker) == 2


def test_without_dask_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"drake-aerial\[study\]"), open_executor(workers=2):
        pass
    with open_executor(workers=0) as executor:
        assert isinstance(executor, InProcessExecutor)


def test_default_workers_are_the_cores(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1, 2}, raising=False)
    pytest.importorskip("distributed")
    assert default_workers() == 3
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
    assert default_workers() == 0
