"""Contacts of a study: found once for each condition and method, then placed on the payload."""

import time
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from drake_aerial._version import __version__
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
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
"""Number of solutions requested beyond those flown, since some may be infeasible."""
# A gripper further from the payload than this does not touch it [m]; as in a transfer.
_TOUCH = TransferParameters().off_surface
# Length of the cables of given contacts [m].
_GIVEN_CABLE = 0.5


@dataclass(frozen=True)
class ContactTask:
    """Task of a worker: find the contacts of one method on one condition.

    Attributes
    ----------
    condition : Condition
        The condition.
    method : str
        Method of transfer, or the label of given contacts.
    seed : int
        Seed of the plan.
    top : int
        Number of solutions wanted.
    version : str
        Package version of the study.
    """

    condition: Condition
    method: str
    seed: int
    top: int
    version: str = __version__

    @property
    def name(self) -> str:
        """Name of the file contacts/NAME.json."""
        return f"{self.condition.name}-{self.method}"


@dataclass(frozen=True, eq=False)
class FoundContacts:
    """Contacts of one method on one condition, or the reason why there are none.

    Attributes
    ----------
    contacts : ContactSolutions or None
        The contacts; None if the transfer failed.
    failure : str or None
        Error message of the transfer.
    wall_s, cpu_s : float
        Wall-clock and CPU time, skill and scan included [s].
    """

    contacts: ContactSolutions | None
    failure: str | None
    wall_s: float
    cpu_s: float


@dataclass(frozen=True, eq=False)
class Placed:
    """A solution placed on the payload itself.

    Attributes
    ----------
    solution : Solution
        The solution; grippers that did not touch the payload are moved to its closest point.
    moved : (n,) array
        Distance by which each gripper was moved [m]; 0 for those that touched.
    obstacles : tuple of Reason
        Reasons against flying it that remain.
    """

    solution: Solution
    moved: Array
    obstacles: tuple[Reason, ...]


@lru_cache(maxsize=4)
def cached_scan(condition: Condition, seed: int) -> PointCloud:
    """Return the scan of a condition for the plan's seed; the last four are cached."""
    return scan(condition, seed_of(seed, "scan"))


@lru_cache(maxsize=4)
def cached_skill(demonstration: str) -> ContactSkill:
    """Return the skill of a demonstration, or of a skill's .npz; the last four are cached."""
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn

    if demonstration.endswith(".npz"):
        return ContactSkill.load(Path(demonstration))
    return learn(Demonstration.read(demonstration))


def find_contacts(task: ContactTask) -> FoundContacts:
    """Transfer a condition's skill to its payload's scan, or return the condition's given contacts.

    Raises
    ------
    InputError
        If the input is bad, or the study has another package version.
    """
    check_version(task.version)
    wall, cpu = time.perf_counter(), time.process_time()
    contacts, failure = None, None
    if task.condition.contacts:
        contacts = _given(task)
    else:
        assert task.condition.demonstration is not None
        from drake_aerial.contacts.transfer import transfer

        cloud = cached_scan(task.condition, task.seed)
        try:
            contacts = transfer(
                cached_skill(task.condition.demonstration),
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
            f"the worker's drake_aerial must have the study's version {version}, "
            f"got {__version__}; install that version"
        )


def place(solution: Solution, payload: Payload) -> Placed:
    """Place a solution on the payload: move grippers that do not touch it to its closest point.

    The paper did so by hand. A gripper does not touch the payload if the transfer found it off the
    surface, or if it is more than 1 cm from the payload.

    Parameters
    ----------
    solution : Solution
        The solution, in the scan's frame S.
    payload : Payload
        The payload with its pose X_SP.
    """
    n = len(solution.X_SG.p)
    points, normals, distance = payload.closest_point(
        transform(invert(payload.X_SP), solution.X_SG.p)
    )
    points, normals = transform(payload.X_SP, points), rotate(payload.X_SP.q, normals)
    touches = distance <= _TOUCH
    off = [reason for reason in solution.reasons if reason.kind is ReasonKind.OFF_SURFACE]
    touches[[reason.gripper or 0 for reason in off]] = False
    obstacles = [reason for reason in solution.reasons if reason not in off]
    if touches.all():
        return Placed(solution, np.zeros(n), tuple(obstacles))
    lowest = TransferParameters().min_elevation
    for i in np.flatnonzero(~touches):
        elevation = float(np.arcsin(np.clip(normals[i, 2], -1.0, 1.0)))
        if elevation < lowest:
            gripper = int(i) if n > 1 else None
            obstacles.append(Reason(ReasonKind.UPSIDE_DOWN_AFTER_MOVE, gripper, value=elevation))
    stays = touches[:, None]
    p = np.where(stays, solution.X_SG.p, points)
    moved = replace(
        solution,
        X_SG=Pose(p, np.where(stays, solution.X_SG.q, _upright(normals))),
        normal=np.where(stays, solution.normal, normals),
        X_SQ=Pose(
            np.where(stays, solution.X_SQ.p, points + (solution.X_SQ.p - solution.X_SG.p)),
            solution.X_SQ.q,
        ),
    )
    return Placed(moved, np.where(touches, 0.0, distance), tuple(obstacles))


def _given(task: ContactTask) -> ContactSolutions:
    """Return given contacts as the only solution of a method that has their label as its name."""
    payload = Payload.read(task.condition.payload)
    sites = dict(task.condition.contacts)[task.method]
    points, normals, _ = payload.closest_point(np.array(sites))
    p, z = transform(payload.X_SP, points), rotate(payload.X_SP.q, normals)
    above = p + [0.0, 0.0, _GIVEN_CABLE]
    level = np.tile([1.0, 0.0, 0.0, 0.0], (len(p), 1))
    cloud = cached_scan(task.condition, task.seed)
    solution = Solution(1, 0.0, True, (), Pose(p, _upright(z)), z, Pose(above, level))
    timing = {"features_s": 0.0, "query_s": 0.0, "optimise_s": 0.0}
    return ContactSolutions(task.method, task.seed, "given", cloud.to_record(), timing, (solution,))


def _upright(z: Array) -> Array:
    """Return rotations (n, 4) whose z axes are z (n, 3)."""
    x = np.zeros_like(z)
    x[:, 0] = 1.0
    return quat_from_xz(np.where(np.abs(z[:, :1]) > 0.999, [0.0, 0.0, 1.0], x), z)
