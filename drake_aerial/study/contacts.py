"""Contacts of a study: found once per condition and method, then set on the payload as they will be flown."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from drake_aerial._version import __version__
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError, JobError
from drake_aerial.geometry import Array, Pose, invert, quat_from_xz, rotate, transform
from drake_aerial.plant.payload import Payload
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.study.conditions import Condition
from drake_aerial.study.scans import scan
from drake_aerial.study.seeds import seed_of

SPARE = 10
"""So many solutions more than are flown are asked for, since some may be infeasible."""
# A gripper further than this from the payload touches nothing [m]; a transfer's own measure.
_TOUCH = TransferParameters().off_surface
_OFF = re.compile(r"^(?:gripper (\d+): )?off the surface")
_GIVEN_CABLE = 0.5


@dataclass(frozen=True)
class ContactTask:
    """What a worker needs to find the contacts of one method on one condition.

    Attributes
    ----------
    condition : Condition
    method : str
        Or the label of given contacts.
    seed : int
        The plan's.
    top : int
        Solutions wanted.
    version : str
        Of the package that asks.
    """

    condition: Condition
    method: str
    seed: int
    top: int
    version: str = __version__

    @property
    def name(self) -> str:
        """As in contacts/NAME.json."""
        return f"{self.condition.name}-{self.method}"

    @property
    def group(self) -> str:
        """Tasks of a group share what a worker keeps from one to the next."""
        return self.condition.name


@dataclass(frozen=True, eq=False)
class FoundContacts:
    """The contacts of one method on one condition, or why there are none.

    Attributes
    ----------
    contacts : ContactSolutions or None
    failure : str or None
        What the transfer said if it found nothing.
    wall_s, cpu_s : float
        What finding them took, skill and scan included [s].
    """

    contacts: ContactSolutions | None
    failure: str | None
    wall_s: float
    cpu_s: float


@dataclass(frozen=True, eq=False)
class Placed:
    """A solution as it can be flown.

    Attributes
    ----------
    solution : Solution
        With grippers that touched nothing moved to the closest point of the payload.
    moved : (n,) array
        How far each was moved [m]; 0 for those that touched.
    obstacles : tuple of str
        What still speaks against flying it.
    """

    solution: Solution
    moved: Array
    obstacles: tuple[str, ...]


@lru_cache(maxsize=4)
def seen(condition: Condition, seed: int) -> PointCloud:
    """Return the scan of a condition under the plan's seed; the last few are kept."""
    return scan(condition, seed_of(seed, "scan"))


@lru_cache(maxsize=4)
def taught(demonstration: str) -> ContactSkill:
    """Return the skill of a demonstration, or of a skill's .npz; the last few are kept."""
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn

    if demonstration.endswith(".npz"):
        return ContactSkill.load(Path(demonstration))
    return learn(Demonstration.read(demonstration))


def find_contacts(task: ContactTask) -> FoundContacts:
    """Transfer a condition's skill to its payload's scan by one method, or take the contacts that are given.

    Raises
    ------
    InputError
        For bad input, or a package of another version.
    """
    check_version(task.version)
    wall, cpu = time.perf_counter(), time.process_time()
    contacts, failure = None, None
    if task.condition.contacts:
        contacts = _given(task)
    else:
        assert task.condition.demonstration is not None
        from drake_aerial.contacts.transfer import transfer

        cloud = seen(task.condition, task.seed)
        try:
            contacts = transfer(
                taught(task.condition.demonstration),
                cloud,
                method=task.method,
                top=task.top,
                seed=seed_of(task.seed, "contacts"),
            )
            contacts = replace(contacts, query=None, scan=None)
        except JobError as error:
            failure = " ".join(str(error).split())
    return FoundContacts(contacts, failure, time.perf_counter() - wall, time.process_time() - cpu)


def check_version(version: str) -> None:
    """Raise InputError if a task comes from another version of the package."""
    if version != __version__:
        raise InputError(
            f"this worker has drake_aerial {__version__}, the study {version}; equal versions accepted"
        )


def place(solution: Solution, payload: Payload) -> Placed:
    """Set a solution on the payload itself: what touches stays, what touches nothing moves to the closest point.

    The paper did so by hand. A gripper touches nothing if the transfer says that it is off the surface, or if it is more than
    1 cm from the payload.

    Parameters
    ----------
    solution : Solution
        In the scan's frame S.
    payload : Payload
        With its pose X_SP.
    """
    n = len(solution.X_SG.p)
    points, normals, distance = payload.closest_point(
        transform(invert(payload.X_SP), solution.X_SG.p)
    )
    points, normals = transform(payload.X_SP, points), rotate(payload.X_SP.q, normals)
    touches = distance <= _TOUCH
    obstacles = []
    for reason in solution.reasons:
        off = _OFF.match(reason)
        if off is None:
            obstacles.append(reason)
        else:
            touches[int(off[1]) - 1 if off[1] else 0] = False
    if touches.all():
        return Placed(solution, np.zeros(n), tuple(obstacles))
    lowest = TransferParameters().min_elevation
    for i in np.flatnonzero(~touches):
        elevation = float(np.arcsin(np.clip(normals[i, 2], -1.0, 1.0)))
        if elevation < lowest:
            name = f"gripper {i + 1}: " if n > 1 else ""
            obstacles.append(
                f"{name}upside down where it was moved to (the surface faces {np.rad2deg(elevation):.0f} deg)"
            )
    stays = touches[:, None]
    p = np.where(stays, solution.X_SG.p, points)
    q = np.where(stays, solution.X_SG.q, _upright(normals))
    hung = np.where(stays, solution.X_SQ.p, points + (solution.X_SQ.p - solution.X_SG.p))
    moved = Solution(
        rank=solution.rank,
        log_likelihood=solution.log_likelihood,
        feasible=solution.feasible,
        reasons=solution.reasons,
        X_SG=Pose(p, q),
        normal=np.where(stays, solution.normal, normals),
        X_SQ=Pose(hung, solution.X_SQ.q),
    )
    return Placed(moved, np.where(touches, 0.0, distance), tuple(obstacles))


def _given(task: ContactTask) -> ContactSolutions:
    """Return given contacts as the one solution of a "method" called after their label."""
    payload = Payload.read(task.condition.payload)
    sites = dict(task.condition.contacts)[task.method]
    points, normals, _ = payload.closest_point(np.array(sites))
    p, z = transform(payload.X_SP, points), rotate(payload.X_SP.q, normals)
    above = p + [0.0, 0.0, _GIVEN_CABLE]
    level = np.tile([1.0, 0.0, 0.0, 0.0], (len(p), 1))
    cloud = seen(task.condition, task.seed)
    solution = Solution(1, 0.0, True, (), Pose(p, _upright(z)), z, Pose(above, level))
    timing = {"features_s": 0.0, "query_s": 0.0, "optimise_s": 0.0}
    return ContactSolutions(task.method, task.seed, "given", cloud.to_record(), timing, (solution,))


def _upright(z: Array) -> Array:
    """Return rotations (n, 4) with z axes `z` (n, 3)."""
    x = np.zeros_like(z)
    x[:, 0] = 1.0
    return quat_from_xz(np.where(np.abs(z[:, :1]) > 0.999, [0.0, 0.0, 1.0], x), z)
