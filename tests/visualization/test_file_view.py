"""The view of contacts: the heat map of their transfer, and the reasons of infeasibility."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from drake_aerial import read_scan, read_skill, transfer
from drake_aerial.contacts.recomputation import recompute_query
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.errors import InputError
from drake_aerial.visualization.colors import heat
from drake_aerial.visualization.file_view import view_of


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The contacts of a box's side-on scan, in a file beside the scan."""
    folder = tmp_path_factory.mktemp("found")
    box = trimesh.creation.box((0.45, 0.35, 0.25))
    points = trimesh.sample.sample_surface(box, 12_000, seed=5)[0]
    viewpoint = np.array([0.4, -0.3, 1.5])
    facing = (points[:, 2] > 0.124) | (points[:, 1] < -0.174) | (points[:, 0] > 0.224)
    np.save(folder / "scan.npy", points[facing])
    solutions = transfer(
        read_skill("flat"), read_scan(folder / "scan.npy", viewpoint=viewpoint), top=3
    )
    solutions.write(folder / "contacts.json")
    return folder / "contacts.json", solutions


def test_the_heat_map_is_the_density_of_the_transfer(found):
    path, solutions = found
    log = solutions.query.log_surface()
    view = view_of(path)
    colors = np.concatenate(view.mesh._colors[:1]).reshape(-1, 6, 3)[:, 0]
    np.testing.assert_allclose(colors, heat(np.exp(log - log.max())), atol=1e-6)
    assert any("likely" in label for _, label in view.legend)


def test_another_skill_is_refused_and_another_viewpoint_is_noticed(found):
    path, solutions = found
    with pytest.raises(InputError, match="edge"):
        view_of(path, skill=read_skill("edge"))
    skill, read = read_skill("flat"), ContactSolutions.read(path)
    cloud = read_scan(path.parent / "scan.npy", viewpoint=solutions.cloud["viewpoint"])
    assert recompute_query(read, skill, cloud) is not None
    assert (
        recompute_query(
            read, skill, read_scan(path.parent / "scan.npy", viewpoint=[0.0, 0.0, -1.5])
        )
        is None
    )


def test_without_the_skill_there_is_no_heat_map(found, tmp_path):
    path, solutions = found
    bad = replace(
        solutions.solutions[1], feasible=False, reasons=("upside down", "off the surface")
    )
    mine = replace(solutions, skill="mine", solutions=(solutions[0], bad), query=None)
    mine.write(path.parent / "mine.json")
    view = view_of(path.parent / "mine.json")
    assert "the skill is not known" in view.text
    assert "upside down; off the surface" in view.text
    assert not any("likely" in label for _, label in view.legend)
