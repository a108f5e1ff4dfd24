"""Random seeds by name: every draw of a study derives from the plan's master seed."""

import hashlib

import numpy as np


def seed_of(base: int, *names: str | int) -> int:
    """Return the seed that belongs to `names` under a master seed.

    A scan's names are ("scan",), a transfer's ("contacts",), a trial's ("flight", trial).
    Conditions on one payload have the same scan, all methods the same scan and generator, and
    trials are paired by their number.

    Parameters
    ----------
    base : int
        Master seed of the plan, not negative.
    names : str or int
        Purpose of the draw.

    Returns
    -------
    int
        Below 2^31; the same on every machine.
    """
    digest = hashlib.sha256("/".join(str(name) for name in names).encode()).digest()
    words = np.frombuffer(digest[:16], dtype="<u4")
    sequence = np.random.SeedSequence([base, *(int(word) for word in words)])
    return int(sequence.generate_state(1)[0] >> 1)
