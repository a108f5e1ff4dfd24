"""Seeds by name: every draw of a study derives from the plan's one seed, whoever draws it and when."""

from __future__ import annotations

import hashlib

import numpy as np


def seed_of(base: int, *names: str | int) -> int:
    """Return the seed that belongs to `names` under a base seed: the same everywhere, unrelated to any other's.

    A scan's seed is that of ("scan",), a transfer's of ("contacts",), a trial's of ("flight", trial): conditions on one
    payload see the same scan, methods see the same scan and draw from the same generator, and trials are paired by their number.

    Parameters
    ----------
    base : int
        Of the plan, not negative.
    names : str or int
        What the draw is for.

    Returns
    -------
    int
        Below 2^31.
    """
    digest = hashlib.sha256("/".join(str(name) for name in names).encode()).digest()
    words = np.frombuffer(digest[:16], dtype="<u4")
    sequence = np.random.SeedSequence([base, *(int(word) for word in words)])
    return int(sequence.generate_state(1)[0] >> 1)
