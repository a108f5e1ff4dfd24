"""`drake-aerial view`: one page for whatever file is given."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.archives import load_archive
from drake_aerial.io.strict_yaml import mapping_from_json
from drake_aerial.visualization.pages import write_picture_page
from drake_aerial.visualization.picture import RED, Color, Picture
from drake_aerial.visualization.pictures import (
    FEATURE_LEGEND,
    HEAT_COLORS,
    RANK_COLORS,
    SKILL_LEGEND,
    contacts_picture,
    features_picture,
    heat,
    skill_picture,
)

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.contacts.solutions import ContactSolutions
    from drake_aerial.skill.contact_skill import ContactSkill

CONTACTS_LEGEND: list[tuple[Color, str]] = [
    (RANK_COLORS[0], "best contact, with its quadrotor"),
    (RANK_COLORS[3], "further contacts"),
    (RED, "cannot be flown"),
]
HEAT_LEGEND: list[tuple[Color, str]] = [
    (HEAT_COLORS[0], "on the scan: unlikely"),
    (HEAT_COLORS[1], "on the scan: half as likely as the best place"),
    (HEAT_COLORS[2], "on the scan: likely"),
]


@dataclass(frozen=True, eq=False)
class View:
    """What is shown of a file that stands still.

    Attributes
    ----------
    picture : Picture
    title, text : str
    legend : list of (colour, label)
    """

    picture: Picture
    title: str
    legend: list[tuple[Color, str]]
    text: str

    def write(self, out: str | Path) -> None:
        """Write it as one self-contained HTML page."""
        write_picture_page(out, self.picture, title=self.title, legend=self.legend, text=self.text)


def write_view(path: str | Path, out: str | Path, *, skill: ContactSkill | None = None) -> str:
    """Write one self-contained HTML page that shows a file.

    Parameters
    ----------
    path : str or Path
        A cloud (.ply, .pcd, .obj, .stl, .npz, .npy), a skill .npz, a contacts.json, a trial.npz, or a trial's folder.
    out : str or Path
        The page.
    skill : ContactSkill, optional
        Of contacts: what they were found with, for the query density; a shipped one is found by its name.

    Returns
    -------
    str
        One line that says what was shown.

    Raises
    ------
    InputError
        If the file is none of these, or the skill is not the one that the contacts were found with.
    """
    if is_trial(path):
        from drake_aerial.simulation.trial_result import TrialResult
        from drake_aerial.visualization.replay import write_replay

        write_replay(out, TrialResult.load(path))
        return f"trial {path} -> {out}"
    view = view_of(path, skill=skill)
    view.write(out)
    return f"{view.title.split()[0]} {path} -> {out}"


def is_trial(path: str | Path) -> bool:
    """Return whether a path is a trial.npz or a trial's folder."""
    path = Path(path)
    return os.path.isdir(path) or _schema(path) == "drake_aerial/trial"


def view_of(path: str | Path, *, skill: ContactSkill | None = None) -> View:
    """Return what is to be shown of a cloud, a skill or contacts; parameters and errors as of `write_view`."""
    path = Path(path)
    if not os.path.isfile(path):
        raise InputError(
            f"no file {path}: give a cloud, a skill .npz, a contacts.json or a trial.npz"
        )
    if path.suffix == ".json":
        from drake_aerial.contacts.solutions import ContactSolutions

        solutions = ContactSolutions.read(path)
        cloud = cloud_of(solutions, path.parent)
        return contacts_view(found_again(solutions, cloud, skill), cloud)
    if _schema(path) == "drake_aerial/skill":
        from drake_aerial.skill.contact_skill import ContactSkill

        return skill_view(ContactSkill.load(path))
    from drake_aerial.cloud.point_cloud import PointCloud

    return cloud_view(PointCloud.read(path))


def cloud_view(cloud: PointCloud) -> View:
    """Return a cloud's surface features: curvature as colour, rims, some frames."""
    from drake_aerial.features.canonical_frame import to_canonical
    from drake_aerial.features.surface_features import compute_features

    cloud_N, _ = to_canonical(cloud)
    features = compute_features(cloud_N)
    extent = " x ".join(f"{size:.3f}" for size in cloud.extent)
    text = (
        f"{len(cloud):,} points, {cloud.dropped_points:,} dropped\n{extent} m\n"
        f"{len(features):,} features, rho {features.rho:g} m\n{int(features.rim.sum()):,} on a rim"
    )
    return View(features_picture(features), f"cloud {_name(cloud.path)}", FEATURE_LEGEND, text)


def skill_view(skill: ContactSkill) -> View:
    """Return what a skill was learnt from."""
    return View(skill_picture(skill), f"skill {skill.label}", SKILL_LEGEND, skill.description)


def contacts_view(solutions: ContactSolutions, cloud: PointCloud) -> View:
    """Return solutions on their scan; with the query density as heat where it is at hand."""
    legend = CONTACTS_LEGEND
    if solutions.query is not None:
        points = solutions.query.scan.features_S.p
        log = solutions.query.log_surface()
        colors = heat(np.exp(log - log.max()))
        legend = [*legend, *HEAT_LEGEND]
        note = "heat: how well the first gripper belongs there"
    else:
        points, colors = _thinned(cloud.points), None
        note = (
            "no heat: centroid asks no density"
            if solutions.method == "centroid"
            else "no heat: the skill is not at hand"
        )
    lines = [f"method {solutions.method}, skill {solutions.skill}, seed {solutions.seed}", note, ""]
    for solution in solutions.solutions:
        state = "feasible" if solution.feasible else "; ".join(map(str, solution.reasons))
        lines.append(f"{solution.rank}  log J {solution.log_likelihood:8.2f}  {state}")
    picture = contacts_picture(points, solutions.solutions, colors=colors)
    return View(picture, f"contacts on {_name(cloud.path)}", legend, "\n".join(lines))


def write_contacts_page(out: str | Path, solutions: ContactSolutions, cloud: PointCloud) -> None:
    """Write a page that shows solutions on their scan; with the query density as heat where it is still at hand."""
    contacts_view(solutions, cloud).write(out)


def found_again(
    solutions: ContactSolutions, cloud: PointCloud, skill: ContactSkill | None = None
) -> ContactSolutions:
    """Return solutions with the densities of their transfer, recomputed; without if the skill is not at hand.

    Raises
    ------
    InputError
        If a skill is given under which the solutions are not as likely as they say.
    """
    from drake_aerial.contacts.recomputation import recompute_query
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn

    if solutions.query is not None or solutions.method == "centroid" or not solutions.solutions:
        return solutions
    used = skill
    if used is None:
        if solutions.skill not in model_files.names("demonstrations"):
            return solutions
        used = learn(Demonstration.read(solutions.skill), seed=0)
    query = recompute_query(solutions, used, cloud)
    if query is None and skill is not None:
        raise InputError(
            f"skill {skill.label!r} is not what found these contacts: under it they are not as likely as they say"
        )
    return replace(solutions, query=query)


def cloud_of(solutions: ContactSolutions, folder: Path) -> PointCloud:
    """Return the cloud that contacts were found on.

    Raises
    ------
    InputError
        If its file is not found, or holds other points.
    """
    from drake_aerial.contacts.scan_lookup import find_scan

    try:
        return find_scan(solutions.cloud, folder)
    except InputError as error:
        raise InputError(
            f"{error}; put the scan beside contacts.json, or write the page with the contacts "
            "(`write_contacts_page`, drake-aerial transfer --html)"
        ) from error


def _schema(path: Path) -> str | None:
    """Return the schema that an .npz of ours names, or None."""
    if path.suffix != ".npz" or not os.path.isfile(path):
        return None
    try:
        arrays = load_archive(path, "an archive")
        if "schema" in arrays:
            return str(arrays["schema"])
        # A trial keeps its schema inside its metrics document.
        return str(mapping_from_json(str(arrays["metrics"]), "metrics")["schema"])
    except (InputError, KeyError):
        return None


def _thinned(points: np.ndarray, most: int = 12000) -> np.ndarray:
    return points[:: max(1, -(-len(points) // most))]


def _name(path: str | None) -> str:
    return Path(path).name if path else "(from memory)"
