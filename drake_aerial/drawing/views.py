"""`drake-aerial view`: one page for whatever file is given."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial.drawing.pages import write_picture_page
from drake_aerial.drawing.picture import RED, Color
from drake_aerial.drawing.pictures import (
    FEATURE_LEGEND,
    RANK_COLORS,
    SKILL_LEGEND,
    contacts_picture,
    features_picture,
    heat,
    skill_picture,
)
from drake_aerial.errors import InputError

if TYPE_CHECKING:
    from drake_aerial.learning.skill import ContactSkill
    from drake_aerial.perception.point_cloud import PointCloud
    from drake_aerial.transferring.solutions import ContactSolutions

CONTACTS_LEGEND: list[tuple[Color, str]] = [
    (RANK_COLORS[0], "best contact, with its quadrotor"),
    (RANK_COLORS[3], "further contacts"),
    (RED, "cannot be flown; or, on the scan: likely"),
]


def write_view(path: str | Path, out: str | Path) -> str:
    """Write one self-contained HTML page that shows a file.

    Parameters
    ----------
    path : str or Path
        A cloud (.ply, .pcd, .obj, .stl, .npz, .npy), a skill .npz, a contacts.json, a trial.npz, or a trial's folder.
    out : str or Path
        The page.

    Returns
    -------
    str
        One line that says what was shown.

    Raises
    ------
    InputError
        If the file is none of these.
    """
    path = Path(path)
    if path.is_dir() or _schema(path) == "drake_aerial/trial":
        from drake_aerial.drawing.replay import write_replay
        from drake_aerial.transport.trial import TrialResult

        write_replay(out, TrialResult.load(path))
        return f"trial {path} -> {out}"
    if not path.is_file():
        raise InputError(f"no file {path}: give a cloud, a skill .npz, a contacts.json or a trial.npz")
    if path.suffix == ".json":
        from drake_aerial.transferring.solutions import ContactSolutions

        solutions = ContactSolutions.read(path)
        write_contacts_page(out, solutions, cloud_of(solutions, path.parent))
        return f"contacts {path} -> {out}"
    if _schema(path) == "drake_aerial/skill":
        from drake_aerial.learning.skill import ContactSkill

        write_skill_page(out, ContactSkill.load(path))
        return f"skill {path} -> {out}"
    from drake_aerial.perception.point_cloud import PointCloud

    write_cloud_page(out, PointCloud.read(path))
    return f"cloud {path} -> {out}"


def write_cloud_page(out: str | Path, cloud: PointCloud) -> None:
    """Write a page that shows a cloud's surface features: curvature as colour, rims, some frames."""
    from drake_aerial.perception.canonical import to_canonical
    from drake_aerial.perception.surface_features import compute_features

    cloud_N, _ = to_canonical(cloud)
    features = compute_features(cloud_N)
    extent = " x ".join(f"{size:.3f}" for size in cloud.extent)
    text = (
        f"{len(cloud):,} points, {cloud.dropped_points:,} dropped\n{extent} m\n"
        f"{len(features):,} features, rho {features.rho:g} m\n{int(features.rim.sum()):,} on a rim"
    )
    write_picture_page(
        out, features_picture(features), title=f"cloud {_name(cloud.path)}", legend=FEATURE_LEGEND, text=text
    )


def write_skill_page(out: str | Path, skill: ContactSkill) -> None:
    """Write a page that shows what a skill was learnt from."""
    write_picture_page(
        out, skill_picture(skill), title=f"skill {skill.label}", legend=SKILL_LEGEND, text=skill.description
    )


def write_contacts_page(out: str | Path, solutions: ContactSolutions, cloud: PointCloud) -> None:
    """Write a page that shows solutions on their scan; with the query density as heat where it is still at hand."""
    if solutions.evidence is not None:
        points = solutions.evidence.features_S.p
        log = solutions.evidence.log_surface()
        colors = heat(np.exp(log - log.max()))
    else:
        points, colors = _thinned(cloud.points), None
    lines = [f"method {solutions.method}, skill {solutions.skill}, seed {solutions.seed}"]
    for solution in solutions.solutions:
        state = "feasible" if solution.feasible else "; ".join(solution.reasons)
        lines.append(f"{solution.rank}  log J {solution.log_likelihood:8.2f}  {state}")
    write_picture_page(
        out,
        contacts_picture(points, solutions.solutions, colors=colors),
        title=f"contacts on {_name(cloud.path)}",
        legend=CONTACTS_LEGEND,
        text="\n".join(lines),
    )


def cloud_of(solutions: ContactSolutions, folder: Path) -> PointCloud:
    """Return the cloud that contacts were found on, looked up where the contacts file says, then beside it.

    Raises
    ------
    InputError
        If it is not there any more, or is another cloud.
    """
    from drake_aerial.perception.point_cloud import PointCloud

    given = solutions.cloud.get("path")
    if not given:
        raise InputError("the contacts were found on a cloud without a file; view them when they are made (--html)")
    candidates: Sequence[str | Path] = (given, folder / given, folder / Path(given).name)
    for candidate in candidates:
        if Path(candidate).is_file():
            cloud = PointCloud.read(candidate)
            if cloud.sha256 != solutions.cloud.get("sha256"):
                raise InputError(f"{candidate} is not the cloud that the contacts were found on (its sha256 differs)")
            return cloud
    raise InputError(f"the contacts' cloud {given} is not there; put it beside the contacts file")


def _schema(path: Path) -> str | None:
    """Return the schema that an .npz of ours names, or None."""
    if path.suffix != ".npz" or not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as archive:
            if "schema" in archive.files:
                return str(archive["schema"])
            # A trial keeps its schema inside its metrics document.
            return str(json.loads(str(archive["metrics"]))["schema"]) if "metrics" in archive.files else None
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
        return None


def _thinned(points: np.ndarray, most: int = 12000) -> np.ndarray:
    return points[:: max(1, -(-len(points) // most))]


def _name(path: str | None) -> str:
    return Path(path).name if path else "(from memory)"
