"""The files of a study's folder, as the report reads them: what is missing is None, and what is broken is said."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.io.archives import load_archive
from drake_aerial.io.strict_yaml import read_json, read_mapping

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.contacts.solutions import ContactSolutions
    from drake_aerial.skill.contact_skill import ContactSkill


@dataclass(frozen=True)
class StudyFiles:
    """What lies beside the records.

    Attributes
    ----------
    folder : Path
        The study's.
    plan : dict
        The content of study.yaml; empty if there is none.
    complaints : list of str
        What could not be read, one line each; grows as files are asked for.
    """

    folder: Path
    plan: dict[str, Any]
    complaints: list[str] = field(default_factory=list)

    @classmethod
    def open(cls, folder: str | Path) -> StudyFiles:
        """Read the plan of a folder; a missing or broken one is a complaint."""
        folder = Path(folder)
        study = cls(folder, {}, [])
        path = folder / "study.yaml"
        if not path.exists():
            study.complaints.append(
                "study.yaml is missing: conditions are described by their names alone"
            )
            return study
        try:
            study.plan.update(read_mapping(path))
        except InputError as error:
            study._complain(str(error))
        return study

    @property
    def conditions(self) -> dict[str, dict[str, Any]]:
        """Conditions by name, in the plan's order."""
        listed = self.plan.get("conditions") or []
        return {str(c["name"]): dict(c) for c in listed if isinstance(c, Mapping) and "name" in c}

    def title(self, condition: str) -> str:
        """Return what a condition is, in words."""
        known = self.conditions.get(condition, {})
        return str(known.get("title") or known.get("description") or condition)

    def phases(self, condition: str) -> dict[str, tuple[float, float]]:
        """Return when a condition's trajectory goes through which phase: name to (start, end) [s]; empty if it is not known."""
        from drake_aerial.references.trajectory_files import read_trajectory, trajectory_from_dict

        given = self.conditions.get(condition, {}).get("trajectory")
        try:
            trajectory = (
                trajectory_from_dict(given)
                if isinstance(given, dict)
                else read_trajectory(str(given))
            )
        except InputError:
            return {}
        return {phase.name: (phase.start, phase.end) for phase in trajectory.phases}

    def contacts(self, condition: str, method: str) -> ContactSolutions | None:
        """Return the contacts as transferred, or None."""
        from drake_aerial.contacts.solutions import ContactSolutions

        path = self.folder / "contacts" / f"{condition}-{method}.json"
        try:
            return ContactSolutions.read(path)
        except InputError as error:
            if path.exists():
                self._complain(str(error))
            return None

    def scan(self, condition: str) -> PointCloud | None:
        """Return a condition's scan, or None."""
        from drake_aerial.cloud.point_cloud import PointCloud

        path = self.folder / "scans" / f"{condition}.npz"
        if not path.exists():
            return None
        try:
            data = load_archive(path, "a scan")
            points, viewpoint = data["points"], data.get("viewpoint")
            if viewpoint is not None and (
                np.size(viewpoint) != 3 or not np.isfinite(viewpoint).all()
            ):
                viewpoint = None
            return PointCloud.read(np.asarray(points, float), viewpoint=viewpoint)
        except (TypeError, ValueError, KeyError, AttributeError, IndexError) as error:
            self._complain(f"scans/{path.name} cannot be read: {type(error).__name__}")
            return None

    def skill(self, condition: str) -> ContactSkill | None:
        """Return what a condition's demonstration taught, or None."""
        from drake_aerial.skill.contact_skill import ContactSkill

        demonstration = self.conditions.get(condition, {}).get("demonstration")
        path = self.folder / "skills" / f"{Path(str(demonstration)).stem}.npz"
        if demonstration is None or not path.exists():
            return None
        try:
            return ContactSkill.load(path)
        except InputError as error:
            self._complain(str(error))
            return None

    def timing(self) -> dict[str, Any]:
        """Return the content of timing.json; empty if there is none."""
        try:
            return read_json(self.folder / "timing.json")
        except InputError:
            return {}

    def _complain(self, text: str) -> None:
        # A report's bytes may not depend on where the folder lies.
        text = text.replace(f"{self.folder}/", "")
        if text not in self.complaints:
            self.complaints.append(text)
