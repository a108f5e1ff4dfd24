"""One thread for linear algebra on small arrays.

The method's products are small: more threads cost more than they give, cost far more where several processes share the
cores, and sum in another order, so that results would depend on the machine.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

_P = ParamSpec("_P")
_R = TypeVar("_R")

_lock = threading.Lock()
_calls = 0
_limits: threadpool_limits | None = None


def one_blas_thread(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Return the function, run with one BLAS thread whatever the environment says; the old number is restored.

    The number is the whole process's: the first of several calls, nested or of several threads, sets it, the last to end
    restores it.
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
    with _lock:
        if _calls == 0:
            _limits = threadpool_limits(limits=1, user_api="blas")
        _calls += 1


def _leave() -> None:
    global _calls, _limits
    with _lock:
        _calls -= 1
        if _calls == 0 and _limits is not None:
            _limits.restore_original_limits()
            _limits = None
