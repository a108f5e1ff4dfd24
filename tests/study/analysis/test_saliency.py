import numpy as np
import trimesh

from drake_aerial.cloud.point_cloud import PointCloud
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
