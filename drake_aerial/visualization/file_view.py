"""`drake-aerial view`: one page of a cloud, a skill, contacts or a trial."""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drake_aerial.choices import BASELINES
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.errors import InputError
from drake_aerial.io import model_files
from drake_aerial.io.archives import load_archive
from drake_aerial.io.strict_yaml import mapping_from_json
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import HEAT_COLORS, RANK_COLORS, RED, heat
from drake_aerial.visualization.meshcat_page import (
    Legend,
    show_mesh,
    start_meshcat,
    write_meshcat_page,
)
from drake_aerial.visualization.method_meshes import (
    FEATURE_LEGEND,
    SKILL_LEGEND,
    contacts_mesh,
    features_mesh,
    skill_mesh,
)

CONTACTS_LEGEND: Legend = [
    (RANK_COLORS[0], "best contact, with its quadrotor"),
    (RANK_COLORS[3], "further contacts"),
    (RED, "infeasible contact"),
]
HEAT_LEGEND: Legend = [
    (HEAT_COLORS[0], "scan: contact unlikely"),
    (HEAT_COLORS[1], "scan: half the highest density"),
    (HEAT_COLORS[2], "scan: contact likely"),
]


@dataclass(frozen=True, eq=False)
class View:
    """A view of a file without animation.

    Attributes
    ----------
    mesh : ColoredMesh
    title, text : str
        On the card of the page.
    legend : list of (colour, label)
    """

    mesh: ColoredMesh
    title: str
    legend: Legend
    text: str

    def write(self, out: str | Path) -> None:
        """Write the view as one self-contained HTML page."""
        meshcat = start_meshcat()
        show_mesh(meshcat, self.mesh)
        write_meshcat_page(out, meshcat, title=self.title, legend=self.legend, text=self.text)


def write_view(path: str | Path, out: str | Path, *, skill: ContactSkill | None = None) -> str:
    """Write one self-contained HTML page that shows a file.

    Parameters
    ----------
    path : str or Path
        A cloud (.ply, .pcd, .obj, .stl, .npz, .npy), a skill .npz, a contacts.json, a trial.npz, or
        the folder of a trial.
    out : str or Path
        The page.
    skill : ContactSkill, optional
        Skill of the contacts, for the heat map; a shipped one is found by its name.

    Returns
    -------
    str
        Kind and file of the input, and the page, in one line.

    Raises
    ------
    InputError
        If the file is of another kind, or the contacts were not computed with the skill.
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
    """Return True for a trial.npz or the folder of a trial."""
    path = Path(path)
    return os.path.isdir(path) or _schema(path) == "drake_aerial/trial"


def view_of(path: str | Path, *, skill: ContactSkill | None = None) -> View:
    """Return the view of a cloud, a skill or contacts; see `write_view`."""
    path = Path(path)
    if not os.path.isfile(path):
        raise InputError(
            f"no such file: {path}; give a cloud, a skill .npz, a contacts.json or a trial.npz"
        )
    if path.suffix == ".json":
        solutions = ContactSolutions.read(path)
        cloud = cloud_of(solutions, path.parent)
        return contacts_view(with_query(solutions, cloud, skill), cloud)
    if _schema(path) == "drake_aerial/skill":
        return skill_view(ContactSkill.load(path))

    return cloud_view(PointCloud.read(path))


def cloud_view(cloud: PointCloud) -> View:
    """Return the view of a cloud's surface features."""
    from drake_aerial.features.canonical_frame import to_canonical
    from drake_aerial.features.surface_features import compute_features

    cloud_N, _ = to_canonical(cloud)
    features = compute_features(cloud_N)
    extent = " x ".join(f"{size:.3f}" for size in cloud.extent)
    text = (
        f"{len(cloud):,} points, {cloud.dropped_points:,} dropped\n{extent} m\n"
        f"{len(features):,} features, rho {features.rho:g} m\n{int(features.rim.sum()):,} on a rim"
    )
    return View(features_mesh(features), f"cloud {_name(cloud.path)}", FEATURE_LEGEND, text)


def skill_view(skill: ContactSkill) -> View:
    """Return the view of a skill: its demonstration and the learnt features."""
    return View(skill_mesh(skill), f"skill {skill.label}", SKILL_LEGEND, skill.description)


def contacts_view(solutions: ContactSolutions, cloud: PointCloud) -> View:
    """Return the view of solutions on their scan, with the query density as a heat map if known."""
    legend = CONTACTS_LEGEND
    if solutions.query is not None:
        points = solutions.query.scan.features_S.p
        log = solutions.query.log_surface()
        colors = heat(np.exp(log - log.max()))
        legend = [*legend, *HEAT_LEGEND]
        note = "heat map: density of the first gripper's contact"
    else:
        points, colors = _thinned(cloud.points), None
        note = (
            f"no heat map: `{solutions.method}` does not compute a density"
            if solutions.method in BASELINES
            else "no heat map: the skill is not known; give it with --skill"
        )
    lines = [f"method {solutions.method}, skill {solutions.skill}, seed {solutions.seed}", note, ""]
    for solution in solutions.solutions:
        state = "feasible" if solution.feasible else "; ".join(map(str, solution.reasons))
        trust = "" if solution.trust is None else f"  trust {solution.trust.probability:.2f}"
        lines.append(f"{solution.rank}  log J {solution.log_likelihood:8.2f}{trust}  {state}")
    lines += _trust_lines(solutions)
    mesh = contacts_mesh(points, solutions.solutions, colors=colors)
    return View(mesh, f"contacts on {_name(cloud.path)}", legend, "\n".join(lines))


def _trust_lines(solutions: ContactSolutions) -> list[str]:
    """Return what speaks for and against the best solution, one line each."""
    best = solutions.best
    if best is None or best.trust is None:
        return []
    least = (solutions.parameters or TransferParameters()).min_trust
    state = (
        "" if solutions.is_trusted else f", below `min_trust` = {least:g}: check it before a flight"
    )
    return [
        "",
        f"trust {best.trust.probability:.2f} in contact {best.rank}{state}",
        *(f"+ {text}" for text in best.trust.speaks_for),
        *(f"- {text}" for text in best.trust.speaks_against),
    ]


def write_contacts_page(out: str | Path, solutions: ContactSolutions, cloud: PointCloud) -> None:
    """Write a page of solutions on their scan, with the query density as a heat map if known."""
    contacts_view(solutions, cloud).write(out)


def with_query(
    solutions: ContactSolutions, cloud: PointCloud, skill: ContactSkill | None = None
) -> ContactSolutions:
    """Return solutions with the densities of their transfer, recomputed; as given if impossible.

    Raises
    ------
    InputError
        If the solutions have other likelihoods under the given skill.
    """
    from drake_aerial.contacts.recomputation import recompute_query
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn

    if solutions.query is not None or solutions.method in BASELINES or not solutions.solutions:
        return solutions
    used = skill
    if used is None:
        if solutions.skill not in model_files.names("demonstrations"):
            return solutions
        used = learn(Demonstration.read(solutions.skill), seed=0)
    query = recompute_query(solutions, used, cloud)
    if query is None and skill is not None:
        raise InputError(
            f"these contacts were not computed with skill {skill.label!r} (likelihoods differ); "
            "give the skill that found them, or none"
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
    """Return the schema in an .npz file of this package, or None."""
    if path.suffix != ".npz" or not os.path.isfile(path):
        return None
    try:
        arrays = load_archive(path, "an archive")
        if "schema" in arrays:
            return str(arrays["schema"])
        # The schema of a trial is in its metrics document.
        return str(mapping_from_json(str(arrays["metrics"]), "metrics")["schema"])
    except (InputError, KeyError):
        return None


def _thinned(points: np.ndarray, most: int = 12000) -> np.ndarray:
    return points[:: max(1, -(-len(points) // most))]


def _name(path: str | None) -> str:
    return Path(path).name if path else "(from memory)"
