"""Parallel work: threads over the machine's cores, and one BLAS thread for small arrays.

Results do not depend on the number of cores. The package's matrix products are small: several BLAS
threads would be slower, and would make results depend on the machine by their order of summation.
"""

import functools
import os
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

_T = TypeVar("_T")
_P = ParamSpec("_P")
_R = TypeVar("_R")

_pool: ThreadPoolExecutor | None = None
_lock = threading.Lock()


def cores() -> int:
    """Return the number of threads: OMP_NUM_THREADS if set, else the available cores."""
    wanted = os.environ.get("OMP_NUM_THREADS", "").split(",")[0].strip()
    if wanted.isdecimal() and int(wanted) > 0:
        return int(wanted)
    return available_cores()


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def for_each(function: Callable[[_T], None], items: Sequence[_T]) -> None:
    """Call a function with every item, in parallel and in any order.

    Array operations release the interpreter lock, so that threads help. For results that do not
    depend on the number of cores, calls must be independent, and so must the items.
    """
    extra_threads = min(cores(), len(items)) - 1
    if extra_threads < 1:
        for item in items:
            function(item)
        return
    waiting = deque(items)

    def work() -> None:
        while True:
            try:
                item = waiting.popleft()
            except IndexError:
                return
            try:
                function(item)
            except BaseException:
                # After an error, no thread starts another item.
                waiting.clear()
                raise

    futures = [_threads().submit(work) for _ in range(extra_threads)]
    try:
        work()
    finally:
        # All items are done: futures that have not started are not needed.
        started = [future for future in futures if not future.cancel()]
        errors = [future.exception() for future in started]
    for error in errors:
        if error is not None:
            raise error


def _threads() -> ThreadPoolExecutor:
    global _pool
    with _lock:
        if _pool is None:
            _pool = ThreadPoolExecutor(max(cores() - 1, 1), thread_name_prefix="drake_aerial")
        return _pool


def _drop_pool() -> None:
    """Drop the pool in a forked process, which has no threads."""
    global _pool, _lock
    _pool, _lock = None, threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_drop_pool)


_blas_lock = threading.Lock()
_calls = 0
_limits: threadpool_limits | None = None


def one_blas_thread(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Decorate a function to run with one BLAS thread.

    The limit holds for the whole process: the first of several nested or concurrent calls sets it,
    and the last one to end restores the old number.
    """

    @functools.wraps(function)
    def limited(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        _enter()
        try:
            return function(*args, **kwargs)
        finally:
            _leave()

    return limited


def _enter() -> None:
    global _calls, _limits
    with _blas_lock:
        if _calls == 0:
            _limits = threadpool_limits(limits=1, user_api="blas")
        _calls += 1


def _leave() -> None:
    global _calls, _limits
    with _blas_lock:
        _calls -= 1
        if _calls == 0 and _limits is not None:
            _limits.restore_original_limits()
            _limits = None
