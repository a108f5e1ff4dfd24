"""Surface features: a frame from the normal and the principal curvatures, and their values, at points of a
cloud.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose, axis_of, perpendicular, quat_about_axis, quat_from_xz, quat_multiply
from drake_aerial.perception import orientation
from drake_aerial.perception.neighbourhoods import BallNeighbourhoods, Block
from drake_aerial.perception.point_cloud import PointCloud

Array = NDArray[np.float64]

# |r1| on a right-angled edge under this regression: the plane fits round the edge off over the ball, whatever rho is.
# Along a clean box's edges its median is 1.17, and 90 % are between 1.10 and 1.22.
EDGE_SALIENCY = 1.15
# Difference of |r1| and |r2| that is rounding, on exactly flat or spherical samples.
_ROUNDING = 1e-9
# Neighbours whose outward normals are more opposed than this cosine are on the other side of a thin wall.
_OTHER_SHEET = -0.8
# Part of a rim's neighbours that may lie beyond it by more than this part of rho.
_BEYOND_RIM, _BEYOND_DISTANCE = 0.05, 0.4


@dataclass(frozen=True)
class FeatureParameters:
    """What surface features depend on; a skill stores them, since features compare only at equal parameters.

    Attributes
    ----------
    rho : float
        Radius of the ball neighbourhood [m].
    voxel : float or None
        Side of the cubes the cloud is downsampled to [m]; None is rho/4, 0 leaves the cloud as it is.
    min_neighbours : int
        Points with fewer neighbours in the ball, themselves included, are left out as stray ones.
    rim_offset : float
        A neighbourhood whose centroid is further than this part of rho from its point, along the surface, is
        one-sided.
    edge_saliency : float
        Saliency of a rim: |r1| on a right-angled edge of a box, which this regression puts at 1.1 to 1.2.
    anisotropy_floor : float
        |r1| below which curvature counts as noise in the anisotropy confidence.
    """

    rho: float = 0.03
    voxel: float | None = None
    min_neighbours: int = 6
    rim_offset: float = 0.25
    edge_saliency: float = EDGE_SALIENCY
    anisotropy_floor: float = 0.05

    def __post_init__(self) -> None:
        if not (np.isfinite(self.rho) and self.rho > 0.0):
            raise InputError(f"rho should be a positive radius in metres, got {self.rho}")
        if self.voxel is not None and not 0.0 <= self.voxel < self.rho:
            raise InputError(f"voxel should be between 0 and rho = {self.rho} m, got {self.voxel}")
        if self.min_neighbours < 4:
            raise InputError(f"min_neighbours should be at least 4, got {self.min_neighbours}")
        if not 0.0 < self.rim_offset < 1.0:
            raise InputError(f"rim_offset should be between 0 and 1, got {self.rim_offset}")
        if not self.edge_saliency >= 0.0:
            raise InputError(f"edge_saliency should not be negative, got {self.edge_saliency}")
        if not self.anisotropy_floor > 0.0:
            raise InputError(f"anisotropy_floor should be positive, got {self.anisotropy_floor}")

    @property
    def voxel_size(self) -> float:
        """Side of the cubes [m] with the default filled in; 0 is none."""
        return self.rho / 4.0 if self.voxel is None else self.voxel


@dataclass(frozen=True, eq=False)
class SurfaceFeatures:
    """Surface features s = (v, r) of N points (paper section III-A), expressed in one frame F.

    Attributes
    ----------
    p : (N, 3) array
        Positions in F [m].
    q : (N, 4) array
        Frames in F (w, x, y, z): x is k1, the direction of the principal curvature of larger magnitude, z
        the outward normal, y = z cross x. At a rim, x points outward across it, whatever the curvatures
        there.
    r : (N, 2) array
        Dimensionless principal curvatures kappa * rho, |r1| >= |r2|, convex positive.
    anisotropy : (N,) array
        Confidence c = (|r1| - |r2|) / max(|r1|, floor), in [0, 1], in the direction of k1; 1 at a rim.
    rim : (N,) bool array
        Where the visible surface ends: neighbourhoods that lie on one side of their point.
    rho : float
        Radius of the neighbourhoods [m].
    edge_saliency : float
        Saliency that rim points are given.

    Examples
    --------
    >>> from drake_aerial import compute_features, read_scan
    >>> features = compute_features(read_scan("box_68x61x28"))
    >>> edges = features.take(features.saliency > 0.9)
    >>> bool(len(edges) < 0.2 * len(features)), bool(edges.r[:, 0].min() > 0.0)  # few, and convex
    (True, True)
    """

    p: Array
    q: Array
    r: Array
    anisotropy: Array
    rim: NDArray[np.bool_]
    rho: float
    edge_saliency: float = EDGE_SALIENCY

    def __len__(self) -> int:
        return len(self.p)

    @property
    def pose(self) -> Pose:
        """The frames v as poses X_Fv, batch (N,)."""
        return Pose(self.p, self.q)

    @property
    def normal(self) -> Array:
        """Outward unit normals in F, (N, 3)."""
        return axis_of(self.q, 2)

    @property
    def saliency(self) -> Array:
        """|r1|, and at a rim an edge's saliency: curvature does not see where the visible surface ends;
        (N,).
        """
        return np.where(self.rim, self.edge_saliency, np.abs(self.r[:, 0]))

    @property
    def k1(self) -> Array:
        """Unit directions of the principal curvature of larger magnitude, in F, (N, 3)."""
        return axis_of(self.q, 0)

    def take(self, index: ArrayLike) -> SurfaceFeatures:
        """Return the features at `index` (integers or a mask)."""
        index = np.asarray(index)
        return replace(
            self,
            p=self.p[index],
            q=self.q[index],
            r=self.r[index],
            anisotropy=self.anisotropy[index],
            rim=self.rim[index],
        )

    def transformed(self, X_GF: Pose) -> SurfaceFeatures:
        """Return the same features expressed in another frame G; X_GF is one pose."""
        pose = X_GF @ self.pose
        return replace(self, p=pose.p, q=pose.q)

    def spun(self, rng: np.random.Generator) -> Pose:
        """Draw frames from the features' own ambiguity: poses X_Fv, batch (N,).

        k1 is known up to its sign, and where the curvatures are alike not at all: each frame is turned about
        its normal by 0 or pi with probability 1/2, except at a rim where the sign is known, and by a
        Gaussian angle of standard deviation pi * exp(-100 c^2) with c the anisotropy.
        """
        flip = np.pi * (rng.random(len(self)) < 0.5)
        flip[self.rim] = 0.0
        spread = np.pi * np.exp(-100.0 * self.anisotropy**2)
        angle = flip + spread * rng.standard_normal(len(self))
        z = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (len(self), 3))
        return Pose(self.p, quat_multiply(self.q, quat_about_axis(z, angle)))


def compute_features(cloud: PointCloud, parameters: FeatureParameters | None = None) -> SurfaceFeatures:
    """Compute the surface features of a cloud, one per occupied voxel.

    The steps: downsample; fit each neighbourhood's plane (principal component analysis) for the normal; turn
    normals outward (towards the viewpoint where known, else consistently); regress the neighbours'
    tangential normal components on their tangential offsets, which gives the Weingarten map, whose
    eigenvalues and eigenvectors are the principal curvatures and directions; find the rim.

    Parts thinner than rho, such as a teapot's handle, fit into one ball whole: a plane fitted to it is not the
    surface's, and some of its points are taken for a rim.

    Parameters
    ----------
    cloud : PointCloud
        A cloud in its canonical frame (z up), so that the features' order is canonical too.
    parameters : FeatureParameters, optional
        Radius, voxel and thresholds.

    Returns
    -------
    SurfaceFeatures
        In the cloud's frame. Points with too few neighbours are left out.

    Raises
    ------
    InputError
        If no part of the cloud has `min_neighbours` points within rho of each of its points.

    Examples
    --------
    >>> import trimesh
    >>> from drake_aerial import PointCloud, compute_features
    >>> ball = PointCloud.read(trimesh.creation.icosphere(subdivisions=4, radius=0.15))
    >>> features = compute_features(ball)
    >>> features.r.mean(axis=0).round(2).tolist()  # rho over the radius: 0.03 / 0.15
    [0.2, 0.2]
    """
    parameters = parameters or FeatureParameters()
    if parameters.voxel_size > 0.0:
        cloud = cloud.downsampled(parameters.voxel_size)
    balls = _dense_part(cloud.points, parameters)
    points = balls.points
    normals = _plane_normals(balls)
    if cloud.viewpoint is not None:
        normals = orientation.towards_viewpoint(points, normals, cloud.viewpoint)
    else:
        normals = orientation.consistently(points, normals, cloud.up, parameters.rho)
    return _curvature_features(balls, normals, parameters)


def _dense_part(points: Array, parameters: FeatureParameters) -> BallNeighbourhoods:
    """Return the neighbourhoods of the points that have enough neighbours, counting only such points."""
    given = len(points)
    while len(points) >= parameters.min_neighbours:
        balls = BallNeighbourhoods(points, parameters.rho)
        enough = balls.counts() >= parameters.min_neighbours
        if enough.all():
            return balls
        points = points[enough]
    raise InputError(
        f"too few points: none of {given} (one per {1e3 * parameters.voxel_size:.3g} mm voxel) has "
        f"{parameters.min_neighbours} neighbours within rho = {parameters.rho:g} m; "
        "give a denser cloud or a larger rho"
    )


def _plane_normals(balls: BallNeighbourhoods) -> Array:
    """Return a unit normal (N, 3) per point, of arbitrary sign: the direction of least spread of its ball."""
    # Sums of absolute coordinates cancel badly far from the origin.
    points = balls.points - balls.points.mean(axis=0)
    upper = np.triu_indices(3)
    products = points[:, upper[0]] * points[:, upper[1]]
    values = np.hstack([np.ones((len(points), 1)), points, products])
    normals = np.empty_like(points)
    for block in balls.blocks():
        sums = block.matrix() @ values
        mean = sums[:, 1:] / sums[:, :1]
        covariance = np.empty((len(sums), 3, 3))
        covariance[:, upper[0], upper[1]] = mean[:, 3:] - mean[:, upper[0]] * mean[:, upper[1]]
        covariance[:, upper[1], upper[0]] = covariance[:, upper[0], upper[1]]
        normals[block.rows] = np.linalg.eigh(covariance)[1][:, :, 0]
    return normals


def _curvature_features(balls: BallNeighbourhoods, normals: Array, parameters: FeatureParameters) -> SurfaceFeatures:
    points, rho = balls.points, balls.radius
    t1 = perpendicular(normals)
    t2 = np.cross(normals, t1)
    parts = [_block_curvature(block, points, normals, t1, t2, parameters) for block in balls.blocks()]
    kappa, k1, outward, rim = (np.concatenate(arrays) for arrays in zip(*parts))
    r = kappa * rho
    magnitude = np.abs(r)
    anisotropy = (magnitude[:, 0] - magnitude[:, 1]) / np.maximum(magnitude[:, 0], parameters.anisotropy_floor)
    anisotropy = np.where(rim, 1.0, anisotropy)
    # Where the curvatures differ by rounding alone, k1 is noise: any fixed tangent is as good, and
    # reproducible.
    umbilic = magnitude[:, 0] - magnitude[:, 1] < _ROUNDING
    x = np.where(rim[:, None], outward, np.where(umbilic[:, None], t1, k1))
    return SurfaceFeatures(points, quat_from_xz(x, normals), r, anisotropy, rim, rho, parameters.edge_saliency)


def _block_curvature(
    block: Block, points: Array, normals: Array, t1: Array, t2: Array, parameters: FeatureParameters
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Return curvatures (m, 2) [1/m], k1 (m, 3), the outward direction (m, 3) and rim (m,) of a block's
    points.
    """
    i, j = block.owners, block.indices
    agreement = sum(normals[i, axis] * normals[j, axis] for axis in range(3))
    same_side = agreement > _OTHER_SHEET
    matrix = block.matrix(same_side)
    tangents = np.stack([t1[block.rows], t2[block.rows]], axis=1)
    origin = points.mean(axis=0)
    p, here = points - origin, points[block.rows] - origin

    count = np.asarray(matrix.sum(axis=1))
    p_sum, n_sum = matrix @ p, matrix @ normals
    pp = (matrix @ (p[:, :, None] * p[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    np_ = (matrix @ (normals[:, :, None] * p[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
    # Offsets from the neighbours' mean: the regression has an intercept, so the error of the point's own
    # normal drops out.
    base = p_sum / count
    spread = pp - _outer(p_sum, base) - _outer(base, p_sum) + count[:, :, None] * _outer(base, base)
    turning = np_ - _outer(n_sum, base)
    spread_T = tangents @ spread @ tangents.transpose(0, 2, 1)
    turning_T = tangents @ turning @ tangents.transpose(0, 2, 1)
    # A trace of ridge: neighbours on one line, or none on this side of a wall, say nothing, hence no
    # curvature.
    spread_T += 1e-6 * parameters.rho**2 * np.eye(2)
    weingarten = np.linalg.solve(spread_T, turning_T.transpose(0, 2, 1))
    kappa, direction = np.linalg.eigh(0.5 * (weingarten + weingarten.transpose(0, 2, 1)))
    first = np.argmax(np.abs(kappa), axis=1)
    rows = np.arange(len(kappa))
    k1 = np.einsum("ni,nij->nj", direction[rows, :, first], tangents)
    kappa = np.stack([kappa[rows, first], kappa[rows, 1 - first]], axis=1)

    offset = p_sum / count - here
    offset -= np.sum(offset * normals[block.rows], axis=1, keepdims=True) * normals[block.rows]
    distance = np.linalg.norm(offset, axis=1)
    outward = np.where(distance[:, None] > 1e-12, -offset / np.maximum(distance, 1e-12)[:, None], k1)
    rim = distance > parameters.rim_offset * parameters.rho
    if rim.any():
        # Sparse samples are lopsided by chance; at a rim there is next to nothing on the outer side.
        asked = np.flatnonzero(rim[i - block.rows.start] & same_side)
        ahead = np.einsum("ij,ij->i", points[j[asked]] - points[i[asked]], outward[i[asked] - block.rows.start])
        beyond = np.bincount(i[asked] - block.rows.start, ahead > _BEYOND_DISTANCE * parameters.rho, minlength=len(rim))
        rim &= beyond <= _BEYOND_RIM * count[:, 0]
    return kappa, k1, outward, rim


def _outer(a: Array, b: Array) -> Array:
    return a[:, :, None] * b[:, None, :]
