"""Cases for the trust in contacts: right and wrong skills on whole and cut scans.

A pair is two kinds of objects, with a demonstration and a scan of each. Every skill is asked on
both scans, so that half of the questions have a wrong skill.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from shape_cases import CORRUPTIONS, Case
from shape_family import kinds_of

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.transfer import transfer
from drake_aerial.contacts.trust.with_trust import evidence_of
from drake_aerial.errors import InputError, JobError
from drake_aerial.skill.contact_skill import ContactSkill

# A contact is right within this share of the size, and at least this distance [m].
RIGHT_SHARE, RIGHT_DISTANCE = 0.05, 0.01
# Conditions of scans in turn: a third is clean, a quarter cut.
SCANS = ("clean", "cut", CORRUPTIONS[0], "clean", "camera", CORRUPTIONS[1], "cut", "clean",
         CORRUPTIONS[2], "clean", CORRUPTIONS[3], "cut", CORRUPTIONS[4], "camera",
         CORRUPTIONS[5])  # fmt: skip
# Every fifth demonstration is the view of one camera.
_CAMERA_TAUGHT = 5


def right_within(size: float) -> float:
    """Return the distance within which a contact is right [m]."""
    return max(RIGHT_DISTANCE, RIGHT_SHARE * size)


@dataclass(frozen=True)
class Pair:
    """Two cases of different kinds, whose skills are asked on both scans."""

    first: Case
    second: Case

    @property
    def key(self) -> str:
        """Name of the pair in records."""
        return f"{self.first.key} {self.second.key}"


def pairs(half: str, count: int, master: int, scans: tuple[str, ...] = SCANS) -> Iterator[Pair]:
    """Yield pairs of cases, in which all sites of a half appear about equally often."""
    sites = [(kind.name, site) for kind in kinds_of(half) for site in kind.sites]
    rng = np.random.default_rng([master, 1])
    drawn: list[tuple[str, str]] = []
    for k in range(count):
        if len(drawn) < 2:
            drawn = [*drawn, *(sites[i] for i in rng.permutation(len(sites)))]
        a = drawn.pop(0)
        b = drawn.pop(next((i for i, site in enumerate(drawn) if site[0] != a[0]), 0))
        if a[0] == b[0]:
            b = next(site for site in sites if site[0] != a[0])
        yield Pair(
            *(
                Case(
                    kind,
                    site,
                    scans[(2 * k + i) % len(scans)],
                    k,
                    master,
                    "camera" if (2 * k + i) % _CAMERA_TAUGHT == 4 else "clean",
                )
                for i, (kind, site) in enumerate((a, b))
            )
        )


def answers(pair: Pair) -> list[dict]:
    """Return one record per question of a pair; those that end with an error have no evidence."""
    records = []
    for asked in (pair.first, pair.second):
        for taught in (pair.first, pair.second):
            record = {
                "pair": pair.key, "kind": asked.kind, "site": asked.site,
                "condition": asked.condition, "skill": f"{taught.kind} {taught.site}",
                "taught_by": taught.taught_by, "right_skill": asked is taught,
                "size": round(asked.asked.size, 4),
            }  # fmt: skip
            try:
                record |= _answer(taught.skill, asked.scan[0], asked)
            except (InputError, JobError) as error:
                record |= {"errors": [], "failure": str(error)[:120]}
            records.append(record)
    return records


def _answer(skill: ContactSkill, cloud: PointCloud, asked: Case) -> dict:
    start = time.process_time()
    found = transfer(skill, cloud, seed=asked.seed)
    cpu_s = time.process_time() - start
    evidence = evidence_of(skill, found.query.scan, found.solutions, TransferParameters())
    p_SG = np.array([solution.X_SG.p[0] for solution in found.solutions])
    return {
        "errors": [round(float(error), 5) for error in asked.errors(p_SG)],
        "feasible": [solution.feasible for solution in found.solutions],
        "evidence": [{k: round(v, 6) for k, v in e.to_dict().items()} for e in evidence],
        "cpu_s": round(cpu_s, 3),
    }
