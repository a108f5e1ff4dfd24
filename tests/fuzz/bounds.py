"""A bound on the time and memory of one input, and what counts as a good end."""

import resource
import signal
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_aerial.errors import DrakeAerialError

SECONDS = 20.0
BYTES = 4 * 2**30
"""More than this process has already."""


class TooLate(BaseException):
    """What nobody catches: TimeoutError is an OSError."""


@contextmanager
def bounded():
    """Raise TooLate, or MemoryError, in what takes longer or more."""

    def late(*_):
        raise TooLate(f"more than {SECONDS} s")

    before = resource.getrlimit(resource.RLIMIT_AS)
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    handler = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    resource.setrlimit(resource.RLIMIT_AS, (size + BYTES, before[1]))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def ends_well(function, *arguments, **keywords):
    """Return the result, or None if the package refused the input with a reason."""
    refusal = None
    with bounded():
        try:
            return function(*arguments, **keywords)
        except DrakeAerialError as error:
            refusal = str(error)
    assert refusal.strip()
    assert len(refusal) < 20_000
    return None


def fuzzed(check, *strategies, short, long):
    """Return two tests of `check`: on `short` inputs, and marked `fuzz` on `long` inputs."""

    def make(count):
        common = {
            "deadline": None,
            "derandomize": True,
            "database": None,
            "suppress_health_check": list(HealthCheck),
        }

        @settings(max_examples=count, **common)
        @given(st.tuples(*strategies))
        def run(drawn):
            check(*drawn)

        return run

    return make(short), pytest.mark.fuzz(make(long))
