"""Surface features with chosen normals, curvatures and rims, for tests."""

import numpy as np

from drake_aerial.features.surface_features import SurfaceFeatures
from drake_aerial.geometry import quat_from_xz


def features(normal, x, r1, rim):
    """Return features 1 m apart along x with given normals, k1, r1 and rims."""
    normal, x = np.array(normal, float), np.array(x, float)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = len(normal)
    r = np.column_stack([np.array(r1, float), np.zeros(count)])
    p = np.column_stack([np.arange(count), np.zeros((count, 2))])
    return SurfaceFeatures(
        p, quat_from_xz(x, normal), r, np.ones(count), np.array(rim, bool), 0.03, edge_saliency=2.0
    )


def five_features():
    """Return features of a wall, a steep roof, a nearly flat one, a flat one, and a flat rim."""
    normals = [[0, -1, 0], [0.6, 0, 0.8], [0.15, 0, np.sqrt(1 - 0.15**2)], [0, 0, 1], [0, 0, 1]]
    x = [[1, 0, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0]]
    return features(normals, x, [0.5, -0.4, 0.8, 1.0, 0.1], [False, False, False, False, True])
