"""Ranked contact solutions, and the contacts.json file (docs/files.md)."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.contact_query import ContactQuery
from drake_aerial.contacts.feasibility.reasons import Reason
from drake_aerial.contacts.hidden_extent import HiddenExtent
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.trust.trust import Trust
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose
from drake_aerial.io.files import write_text
from drake_aerial.io.record_text import record_to_mapping
from drake_aerial.io.records import record_from_mapping
from drake_aerial.io.strict_yaml import read_json, shown

SCHEMA = "drake_aerial/contacts"
VERSION = 1


@dataclass(frozen=True, eq=False)
class Solution:
    """One configuration of n grippers and quadrotors, in the cloud's frame S.

    Attributes
    ----------
    rank : int
        1 for the likeliest.
    log_likelihood : float
        log J; comparable within one transfer only.
    feasible : bool
        True if the solution passes all feasibility checks.
    reasons : tuple of Reason
        The checks that it fails; `str(reason)` is the text of a reason.
    X_SG : Pose
        Grippers, batch (n,): positions [m], rotations with z along the gripper's axis.
    normal : (n, 3) array
        Outward unit normals of the surface at the contacts, in S.
    X_SQ : Pose
        Quadrotors, batch (n,).
    trust : Trust or None
        Probability that the solution is right, with reasons; None for methods that have none, for
        contacts that were given, and for files of earlier versions.
    """

    rank: int
    log_likelihood: float
    feasible: bool
    reasons: tuple[Reason, ...]
    X_SG: Pose
    normal: Array
    X_SQ: Pose
    trust: Trust | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the solution's entry of contacts.json."""
        grippers = [
            {"position": p.tolist(), "quaternion_wxyz": q.tolist(), "normal": n.tolist()}
            for p, q, n in zip(self.X_SG.p, self.X_SG.q, self.normal)
        ]
        quadrotors = [
            {"position": p.tolist(), "quaternion_wxyz": q.tolist()}
            for p, q in zip(self.X_SQ.p, self.X_SQ.q)
        ]
        entry = {
            "rank": self.rank,
            "log_likelihood": self.log_likelihood,
            "feasible": self.feasible,
            "reasons": [str(reason) for reason in self.reasons],
            "grippers": grippers,
            "quadrotors": quadrotors,
        }
        return entry if self.trust is None else {**entry, "trust": self.trust.to_dict()}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Solution:
        """Return the solution of an entry of contacts.json; the inverse of `to_dict`."""
        grippers, quadrotors = values["grippers"], values["quadrotors"]
        if len(grippers) != len(quadrotors) or not grippers:
            raise ValueError(
                "`grippers` and `quadrotors` must be of equal length and not empty, "
                f"got {len(grippers)} and {len(quadrotors)}"
            )
        return cls(
            rank=int(values["rank"]),
            log_likelihood=float(values["log_likelihood"]),
            feasible=bool(values["feasible"]),
            reasons=tuple(Reason.from_text(text) for text in values["reasons"]),
            X_SG=_poses(grippers),
            normal=_rows(grippers, "normal", 3),
            X_SQ=_poses(quadrotors),
            trust=Trust.from_dict(values["trust"]) if values.get("trust") is not None else None,
        )


@dataclass(frozen=True, eq=False)
class ContactSolutions:
    """The result of one transfer: distinct solutions, the likeliest first.

    Attributes
    ----------
    method : str
        Name of the method.
    seed : int
        Random seed of the transfer.
    skill : str
        Label of the skill.
    cloud : dict
        Record of the cloud: `path`, `sha256`, `points` (count), `dropped_points`, `centroid` (3,)
        [m], `up` (3,), and `viewpoint` (3,) [m] or None.
    timing : dict
        Wall-clock times `features_s`, `query_s`, `optimise_s` [s].
    solutions : tuple of Solution
        Ranked solutions.
    parameters : TransferParameters or None
        Parameters of the transfer; None for contacts that were given, or written without them.
    query : ContactQuery or None
        Scan and densities that were searched, for pictures and `refine`. None for
        baselines, which have none, and for solutions read from a file, which does not hold them.
    scan : PointCloud or None
        Cloud that the contacts were found on; not written to the file.
    hidden : tuple of HiddenExtent
        Dimensions of the object whose ends are not both seen, with the contacts' intervals; empty
        if they are, and for a cloud whose boundary is not known.

    Examples
    --------
    >>> import json
    >>> from drake_aerial import read_scan, read_skill, transfer
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), method="centroid")
    >>> document = json.loads(contacts.to_json())
    >>> document["schema"], document["solutions"][0]["feasible"]
    ('drake_aerial/contacts', True)
    """

    method: str
    seed: int
    skill: str
    cloud: dict[str, Any]
    timing: dict[str, float]
    solutions: tuple[Solution, ...]
    parameters: TransferParameters | None = None
    query: ContactQuery | None = field(default=None, repr=False)
    scan: PointCloud | None = field(default=None, repr=False)
    hidden: tuple[HiddenExtent, ...] = ()

    def __len__(self) -> int:
        return len(self.solutions)

    def __getitem__(self, index: int) -> Solution:
        return self.solutions[index]

    @property
    def X_SG(self) -> Pose:
        """Grippers of all K solutions in S, batch (K, n); there must be at least one solution."""
        return Pose(
            np.stack([solution.X_SG.p for solution in self.solutions]),
            np.stack([solution.X_SG.q for solution in self.solutions]),
        )

    @property
    def best(self) -> Solution | None:
        """The likeliest feasible solution, or None."""
        return next((solution for solution in self.solutions if solution.feasible), None)

    @property
    def is_trusted(self) -> bool:
        """Whether the best solution's trust reaches `min_trust`; True if it has no trust."""
        if self.best is None or self.best.trust is None:
            return True
        parameters = self.parameters or TransferParameters()
        return self.best.trust.probability >= parameters.min_trust

    def to_dict(self) -> dict[str, Any]:
        """Return the content of contacts.json: lengths in metres, in the cloud's frame."""
        document: dict[str, Any] = {
            "schema": SCHEMA,
            "version": VERSION,
            "units": "m",
            "frame": "cloud",
            "method": self.method,
            "seed": self.seed,
            "skill": self.skill,
            "cloud": self.cloud,
            "timing": self.timing,
            "solutions": [solution.to_dict() for solution in self.solutions],
        }
        if self.hidden:
            document["hidden"] = [extent.to_dict() for extent in self.hidden]
        if self.parameters is not None:
            document["parameters"] = record_to_mapping(self.parameters)
        return document

    def to_json(self) -> str:
        """Return contacts.json as text."""
        return json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n"

    def write(self, path: str | Path) -> None:
        """Write contacts.json atomically.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        write_text(path, self.to_json())

    @classmethod
    def read(cls, path: str | Path) -> ContactSolutions:
        """Read a contacts.json.

        Raises
        ------
        InputError
            If the file is missing, is not JSON, has another schema or version, or is incomplete.
        """
        values = read_json(path)
        schema = values.get("schema")
        if schema != SCHEMA:
            raise InputError(f"{path}: `schema` must be {SCHEMA!r}, got {shown(schema)}")
        if values.get("version") != VERSION:
            raise InputError(
                f"{path}: `version` must be {VERSION}, got {shown(values.get('version'))}"
            )
        given = values.get("parameters")
        try:
            return cls(
                method=str(values["method"]),
                seed=int(values["seed"]),
                skill=str(values["skill"]),
                cloud=dict(values["cloud"]),
                timing=dict(values["timing"]),
                solutions=tuple(Solution.from_dict(entry) for entry in values["solutions"]),
                parameters=None
                if given is None
                else record_from_mapping(TransferParameters, given, f"{path}: parameters"),
                hidden=tuple(HiddenExtent.from_dict(entry) for entry in values.get("hidden", ())),
            )
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
            raise InputError(f"{path} has incomplete or damaged contacts: {error}") from error


def _rows(entries: list[dict[str, Any]], key: str, count: int) -> Array:
    rows = np.array([entry[key] for entry in entries], dtype=float)
    if rows.shape != (len(entries), count) or not np.isfinite(rows).all():
        raise ValueError(f"`{key}` must be {count} finite numbers, got {rows.tolist()}")
    return rows


def _poses(entries: list[dict[str, Any]]) -> Pose:
    return Pose(_rows(entries, "position", 3), _rows(entries, "quaternion_wxyz", 4))
