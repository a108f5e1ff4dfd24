"""Who does a study's tasks: this process, or the workers of a Dask cluster."""

from __future__ import annotations

import gc
import logging
import os
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from queue import Empty, SimpleQueue
from typing import Any, Protocol, TypeVar

from drake_aerial.errors import InputError, JobError

DIAGRAMS_PER_WORKER = 100
"""A worker that has built more diagrams than this is replaced by a fresh process."""
# How long a cluster may be without any worker [s].
_PATIENCE = 120.0
# How often the workers are counted while nothing ends [s].
_LOOK = 1.0


class Task(Protocol):
    """A task has the `group` of those that share a worker's cached things, and a `name`."""

    @property
    def group(self) -> str:
        """Tasks of one group go to one worker while it lasts."""

    @property
    def name(self) -> str:
        """What messages call it."""


T = TypeVar("T", bound=Task)
R = TypeVar("R")


class Workers(Protocol):
    """Anything that does tasks."""

    def run(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[T, R | Exception]]:
        """Yield every task with its result, or with the error it raised, in the order in which they end."""


class ThisProcess:
    """Does one task after the other, here."""

    def run(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[T, R | Exception]]:
        """Yield every task with its result, or with the error it raised."""
        for task in tasks:
            result: R | Exception
            try:
                result = function(task)
            except (
                Exception
            ) as error:  # whatever a task raises is its result, as it is from a cluster
                result = error
            yield task, result


class DaskWorkers:
    """Does tasks on the workers of a Dask cluster: one at a time on each, so that a worker that dies costs that one only.

    Dask gives a dead worker's task to another. Tasks of one group go to one worker while it lasts, which keeps what they share.

    Parameters
    ----------
    client : distributed.Client
    """

    def __init__(self, client: Any):
        self._client = client

    def run(
        self, function: Callable[[T], R], tasks: Sequence[T]
    ) -> Iterator[tuple[T, R | Exception]]:
        """Yield every task with its result, or with the error it raised, as they end.

        Raises
        ------
        JobError
            If the scheduler is lost, or has no workers for two minutes.
        """
        from concurrent.futures import CancelledError

        from distributed.client import FutureCancelledError

        waiting = _Queue(tasks)
        running: dict[Any, tuple[T, str]] = {}
        ended: SimpleQueue[Any] = SimpleQueue()
        alone_since: float | None = None
        try:
            while waiting or running:
                addresses = list(self._client.nthreads())
                alone_since = None if addresses else alone_since or time.monotonic()
                if alone_since is not None and time.monotonic() - alone_since > _PATIENCE:
                    raise JobError(f"the scheduler has had no workers for {_PATIENCE:.0f} s")
                busy = {address for _, address in running.values()}
                for address in addresses:
                    if address in busy or not waiting:
                        continue
                    task = waiting.next(address)
                    # Pinned, but free to go elsewhere if that worker dies.
                    future = self._client.submit(
                        function, task, pure=False, workers=[address], allow_other_workers=True
                    )
                    future.add_done_callback(ended.put)
                    running[future] = (task, address)
                try:
                    future = ended.get(timeout=_LOOK)
                except Empty:
                    if any(future.status in ("cancelled", "lost") for future in running):
                        raise JobError("the scheduler forgot a task") from None
                    continue
                error = future.exception()
                result = future.result() if error is None else error
                task, address = running.pop(future)
                yield task, result
                if getattr(result, "diagrams", 0) >= DIAGRAMS_PER_WORKER:
                    self._replace(address)
        except (OSError, CancelledError, FutureCancelledError, JobError) as error:
            why = " ".join(str(error).split()) or type(error).__name__
            raise JobError(
                f"the cluster was lost ({why}); run the same command again to go on"
            ) from error

    def _replace(self, address: str) -> None:
        """Start a fresh process in a worker's place; one without a nanny stays as it is."""
        try:
            self._client.restart_workers([address], timeout=60, raise_for_error=False)
        except ValueError:
            logging.getLogger(__name__).info("worker %s has no nanny and is not replaced", address)


class _Queue:
    """Tasks waiting, by group."""

    def __init__(self, tasks: Sequence[Any]):
        self._groups: dict[str, deque[Any]] = {}
        for task in tasks:
            self._groups.setdefault(task.group, deque()).append(task)
        self._of: dict[str, str] = {}

    def __bool__(self) -> bool:
        return bool(self._groups)

    def next(self, address: str) -> Any:
        """Take the next task for a worker: of its own group, else of a group that nobody flies, else of any."""
        group = self._of.get(address)
        if group not in self._groups:
            taken = {g for a, g in self._of.items() if a != address}
            free = next((g for g in self._groups if g not in taken), None)
            # Near the end the longest group is shared.
            group = (
                free if free is not None else max(self._groups, key=lambda g: len(self._groups[g]))
            )
            self._of[address] = group
        assert group is not None
        tasks = self._groups[group]
        task = tasks.popleft()
        if not tasks:
            del self._groups[group]
        return task


@contextmanager
def hired(workers: int = 0, scheduler: str | None = None) -> Iterator[Workers]:
    """Yield workers: this process (0), a local cluster of so many processes of one thread, or a scheduler's.

    Raises
    ------
    InputError
        If Dask is needed and not installed, or the scheduler does not answer.
    """
    if scheduler is None and workers == 0:
        yield ThisProcess()
        return
    if workers < 0:
        raise InputError(f"{workers} workers; a number from 0 is accepted")
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        wanted = f"scheduler {scheduler!r} needs" if scheduler else f"{workers} workers need"
        raise InputError(
            f"{wanted} Dask, which is not installed: pip install 'drake-aerial[study]', or give 0 workers (--workers 0)"
        ) from error
    # What is garbage here, renderers among it, must not be freed by one of the cluster's threads: they would hang.
    gc.collect()
    one_thread = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    settings = {
        "distributed.nanny.pre-spawn-environ": {
            **dask.config.get("distributed.nanny.pre-spawn-environ", {}),
            **one_thread,
            # Dask has freed memory given back at once; a flight's is wanted again a moment later, and each page of it faults.
            "MALLOC_TRIM_THRESHOLD_": str(2**27),
        },
        # It stops a worker a hundred times a second to see what it is doing.
        "distributed.worker.profile.enabled": False,
        # On a busy machine a flight may keep its worker from answering for long; one that dies is noticed at once anyway.
        "distributed.comm.timeouts.connect": "60s",
        "distributed.scheduler.worker-ttl": "1 hour",
    }
    with dask.config.set(settings):
        if scheduler is not None:
            # What it would log of a lost scheduler, tracebacks and all, is said in one line.
            logging.getLogger("distributed").setLevel(logging.CRITICAL)
            try:
                client = Client(scheduler, timeout=15, set_as_default=False)
            except (OSError, ValueError, TimeoutError) as error:
                raise InputError(
                    f"no Dask scheduler answers at {scheduler}: {_first_line(error)}"
                ) from error
            with client:
                yield DaskWorkers(client)
            return
        with ExitStack() as stack:
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
            yield DaskWorkers(client)


def default_workers() -> int:
    """Return as many workers as there are cores to use, or 0 where Dask is not installed or there is one core."""
    from importlib.util import find_spec

    cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return cores if cores > 1 and find_spec("distributed") is not None else 0


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
