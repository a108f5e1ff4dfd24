import numpy as np
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.transfer import transfer
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from drake_aerial.study.analysis.own_likelihood import own_likelihood
from drake_aerial.study.analysis.saliency import SalientSurface


def box_cloud():
    return PointCloud.read(trimesh.creation.box((0.6, 0.5, 0.3)), samples=8000)


def test_a_boxs_edge_is_rich_and_its_middle_is_not():
    surface = SalientSurface(box_cloud())
    corner, edge, middle = surface.percentile(
        np.array([[0.3, 0.25, 0.15], [0.3, 0.0, 0.15], [0.0, 0.0, 0.15]])
    )
    assert corner > 0.95
    assert corner >= edge > 0.7
    assert middle < 0.4
    # A place drawn blindly has one half on average.
    drawn = np.random.default_rng(0).integers(len(surface.points), size=400)
    assert abs(surface.percentile(surface.points[drawn]).mean() - 0.5) < 0.05


def test_the_baselines_objective_is_found_again_from_its_files():
    skill = learn(Demonstration.read("flat"))
    cloud = box_cloud()
    baseline = transfer(skill, cloud, method="kopicki", top=3, seed=4)
    ours = transfer(skill, cloud, method="task", top=3, seed=4)
    result = own_likelihood("A", skill, cloud, baseline, ours, 3)
    assert result.note == ""
    assert result.own == tuple(s.log_likelihood for s in baseline.solutions)
    assert result.rival is not None
    # Its own best is what annealing found under the very same objective, ours was found under another.
    assert result.rival < max(result.own) + 1.0
    again = own_likelihood("A", skill, cloud, baseline, baseline, 3)
    assert abs(again.rival - max(result.own)) < 1e-6
    other = own_likelihood("A", skill, PointCloud.read(1.1 * cloud.points), baseline, ours, 3)
    assert other.rival is None
    assert "not those of the transfer" in other.note
