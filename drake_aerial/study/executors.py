"""Task executors of a study: in this process, or on the workers of a Dask cluster."""

import gc
import logging
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any, Protocol, TypeVar

from drake_aerial.errors import InputError, JobError
from drake_aerial.parallel import available_cores

DIAGRAMS_PER_WORKER = 100
"""A worker that has built this many diagrams is restarted: Drake keeps the memory of each."""
_LONGEST_WAIT = 120.0
"""Longest time of a cluster without a worker [s]."""
_POLL_PERIOD = 1.0
"""Time between two counts of the workers while no task ends [s]."""

T = TypeVar("T")
R = TypeVar("R")


class Executor(Protocol):
    """Executor of the tasks of a study."""

    def run(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[T, R | Exception]]:
        """Yield each task with its result, or with the error it raised, as the tasks end."""


class InProcessExecutor:
    """Executor that runs one task after the other in this process."""

    def run(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[T, R | Exception]]:
        """Yield each task with its result, or with the error it raised."""
        for task in tasks:
            result: R | Exception
            try:
                result = function(task)
            except Exception as error:
                result = error
            yield task, result


class DaskExecutor:
    """Executor that runs one task at a time on each worker of a Dask cluster.

    Dask gives the task of a worker that dies to another worker.

    Parameters
    ----------
    client : distributed.Client
    """

    def __init__(self, client: Any):
        self._client = client

    def run(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[T, R | Exception]]:
        """Yield each task with its result, or with the error it raised, as the tasks end.

        Raises
        ------
        JobError
            If the scheduler is lost, or has no workers for two minutes.
        """
        from concurrent.futures import CancelledError

        from distributed.client import FutureCancelledError

        waiting = deque(tasks)
        running: dict[Any, T] = {}
        try:
            while waiting or running:
                workers = self._count_workers()
                while waiting and len(running) < workers:
                    task = waiting.popleft()
                    running[self._client.submit(function, task, pure=False)] = task
                for future in self._finished(list(running)):
                    error = future.exception()
                    result = future.result() if error is None else error
                    yield running.pop(future), result
                    if waiting and getattr(result, "diagrams", 0) >= DIAGRAMS_PER_WORKER:
                        self._restart_worker_of(future)
        except (OSError, CancelledError, FutureCancelledError, JobError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise JobError(
                f"the cluster was lost ({why}); run the same command again to resume the study"
            ) from error

    def _count_workers(self) -> int:
        """Return the number of workers; wait for the first."""
        end = time.monotonic() + _LONGEST_WAIT
        while not (count := len(self._client.nthreads())):
            if time.monotonic() > end:
                raise JobError(f"the scheduler has had no workers for {_LONGEST_WAIT:.0f} s")
            time.sleep(_POLL_PERIOD)
        return count

    def _finished(self, running: list[Any]) -> set[Any]:
        """Return the futures that are done, after one poll period at the latest."""
        from distributed import wait

        try:
            with self._client.as_current():
                done: set[Any] = wait(running, _POLL_PERIOD, "FIRST_COMPLETED").done
        except TimeoutError:
            if any(future.status in ("cancelled", "lost") for future in running):
                raise JobError("the scheduler lost a task") from None
            return set()
        return done

    def _restart_worker_of(self, future: Any) -> None:
        """Restart the process that holds a result; a worker without a nanny stays as it is."""
        holders = self._client.who_has([future]).values()
        addresses = [address for holder in holders for address in holder]
        try:
            self._client.restart_workers(addresses, timeout=60, raise_for_error=False)
        except ValueError:
            logging.getLogger(__name__).info("no nanny restarts the workers %s", addresses)


@contextmanager
def open_executor(workers: int = 0, scheduler: str | None = None) -> Iterator[Executor]:
    """Yield an executor, and close its cluster afterwards.

    Parameters
    ----------
    workers : int
        Number of processes of a local cluster; 0 for this process.
    scheduler : str, optional
        Address of a Dask scheduler, instead of a local cluster.

    Raises
    ------
    InputError
        If Dask is needed and not installed, or the scheduler does not answer.
    """
    if scheduler is None and workers == 0:
        yield InProcessExecutor()
        return
    if workers < 0:
        raise InputError(f"`workers` must be at least 0, got {workers}")
    try:
        import dask
        from distributed import Client
    except ImportError as error:
        wanted = f"scheduler {scheduler!r} needs" if scheduler else f"{workers} workers need"
        raise InputError(
            f"{wanted} Dask, which is not installed: pip install 'drake-aerial[study]', or give "
            "0 workers (--workers 0)"
        ) from error
    # Collect garbage here: the cluster's threads must not free Drake's renderers, they would hang.
    gc.collect()
    # An interrupt inside Dask's `sync` makes its event loop log a NameError with a traceback.
    logging.getLogger("tornado.application").setLevel(logging.CRITICAL)
    with dask.config.set(_dask_settings(dask.config)), ExitStack() as stack:
        if scheduler is None:
            client = _start_local_cluster(workers, stack)
        else:
            # The one-line error is enough; Dask would log tracebacks of a lost scheduler.
            logging.getLogger("distributed").setLevel(logging.CRITICAL)
            try:
                client = Client(scheduler, timeout=15, set_as_default=False)
            except (OSError, ValueError, TimeoutError) as error:
                reason = (str(error).splitlines() or [type(error).__name__])[0][:200]
                raise InputError(f"no Dask scheduler answers at {scheduler}: {reason}") from error
            stack.enter_context(client)
        yield DaskExecutor(client)


def _dask_settings(config: Any) -> dict[str, Any]:
    one_thread = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    environment = "distributed.nanny.pre-spawn-environ"
    return {
        environment: {
            **config.get(environment, {}),
            **one_thread,
            # Dask's nanny trims freed memory immediately, which causes page faults on the next
            # flight.
            "MALLOC_TRIM_THRESHOLD_": str(2**27),
        },
        # The profiler stops a worker a hundred times a second.
        "distributed.worker.profile.enabled": False,
        # A worker may not answer for long during a flight; a dead one is noticed in any case.
        "distributed.comm.timeouts.connect": "60s",
        "distributed.scheduler.worker-ttl": "1 hour",
    }


def _start_local_cluster(workers: int, stack: ExitStack) -> Any:
    """Return the client of a cluster of processes with one thread each."""
    from distributed import Client, LocalCluster

    cluster = LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        memory_limit=0,
        silence_logs=logging.ERROR,
    )
    stack.enter_context(cluster)
    client = stack.enter_context(Client(cluster, set_as_default=False))
    # A terminal sends Ctrl-C to the workers too; the client ends them.
    client.register_worker_callbacks(lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    return client


def default_workers() -> int:
    """Return the number of cores, or 0 if it is 1 or Dask is not installed."""
    from importlib.util import find_spec

    cores = available_cores()
    return cores if cores > 1 and find_spec("distributed") is not None else 0
