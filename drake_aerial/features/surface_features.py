"""Surface features of a cloud: frames from normals and principal curvatures, and curvatures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from annotated_types import Ge, Lt
from numpy.typing import ArrayLike, NDArray

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.features import orientation
from drake_aerial.features.curvature import Curvature
from drake_aerial.features.neighbourhoods import order_by_place
from drake_aerial.features.plane_fit import fit_planes
from drake_aerial.features.sampling_distance import check_sampling, remedy
from drake_aerial.geometry import (
    Array,
    Pose,
    axis_of,
    perpendicular,
    quat_about_axis,
    quat_from_xz,
    quat_multiply,
)
from drake_aerial.io.records import NonNegative, Positive, Whole, record
from drake_aerial.parallel import one_blas_thread

# |r1| on a right-angled edge: plane fits smooth the edge over the ball, at any rho.
# Along the edges of a clean box, the median is 1.17; 90 % are between 1.10 and 1.22.
EDGE_SALIENCY = 1.15
# A cloud with more hidden points than this fraction is no single view.
_HIDDEN = 0.1
# Rounding error of |r1| - |r2| on exactly flat or spherical samples.
_ROUNDING = 1e-9


@record(frozen=True)
class FeatureParameters:
    """Parameters of surface features.

    A skill stores them, since features compare only at equal parameters.

    Examples
    --------
    >>> from drake_aerial import FeatureParameters, compute_features, read_scan
    >>> coarse = compute_features(read_scan("bunny"), FeatureParameters(rho=0.05))
    >>> coarse.rho
    0.05
    """

    rho: Positive = 0.03
    """Radius of the ball neighbourhood [m]."""
    voxel: NonNegative | None = None
    """Edge of the cubes that the cloud is downsampled to [m], below rho; None for rho / 4, 0 for no
    downsampling."""
    min_neighbours: Annotated[Whole, Ge(4)] = 6
    """Smallest number of points in a neighbourhood, its centre included; points with fewer are
    dropped."""
    rim_offset: Annotated[Positive, Lt(1)] = 0.25
    """Offset of a neighbourhood's centroid along the surface, as a fraction of rho, above which its
    centre is on a rim (dimensionless)."""
    edge_saliency: NonNegative = EDGE_SALIENCY
    """Saliency of rim points; 1.1 to 1.2 is |r1| on a right-angled edge (dimensionless)."""
    anisotropy_floor: Positive = 0.05
    """Value of |r1| below which curvature counts as noise in the anisotropy (dimensionless)."""

    def __post_init__(self) -> None:
        if self.voxel is not None and self.voxel >= self.rho:
            raise InputError(f"`voxel` must be < rho = {self.rho:g} m, got {self.voxel}")

    @property
    def voxel_size(self) -> float:
        """Voxel size [m] after the default is filled in; 0 means no downsampling."""
        return self.rho / 4.0 if self.voxel is None else self.voxel


@dataclass(frozen=True, eq=False)
class SurfaceFeatures:
    """Surface features s = (v, r) of N points (paper section III-A), expressed in one frame F.

    Attributes
    ----------
    p : (N, 3) array
        Positions in F [m].
    q : (N, 4) array
        Frames in F (w, x, y, z): x is k1, the direction of the principal curvature of larger
        magnitude, z the outward normal, y = z cross x. At a rim, x points outward across it.
    r : (N, 2) array
        Dimensionless principal curvatures kappa * rho, |r1| >= |r2|, convex positive.
    anisotropy : (N,) array
        Confidence c in k1: (|r1| - |r2|) / max(|r1|, floor), in [0, 1]; 1 at a rim.
    rim : (N,) bool array
        True where the visible surface ends: all neighbours lie on one side.
    rho : float
        Radius of the neighbourhoods [m].
    edge_saliency : float
        Saliency of rim features.
    assumptions : tuple of Assumption
        Assumptions about the cloud's spacing and its outward side.

    Examples
    --------
    >>> from drake_aerial import compute_features, read_scan
    >>> features = compute_features(read_scan("box_68x61x28"))
    >>> edges = features.take(features.saliency > 0.9)
    >>> bool(len(edges) < 0.2 * len(features)), bool(edges.r[:, 0].min() > 0.0)  # few and convex
    (True, True)
    """

    p: Array
    q: Array
    r: Array
    anisotropy: Array
    rim: NDArray[np.bool_]
    rho: float
    edge_saliency: float = EDGE_SALIENCY
    assumptions: tuple[Assumption, ...] = ()

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
        """Saliency (N,): |r1|, or `edge_saliency` at rims, where curvature is undefined."""
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
        """Draw one frame per feature within its ambiguity: poses X_Fv, batch (N,).

        The sign of k1 is unknown, and k1 itself where the curvatures are equal. Each frame turns
        about its normal by 0 or pi with probability 1/2, except at a rim, and by a Gaussian angle
        of standard deviation pi * exp(-100 c^2) with the anisotropy c.
        """
        flip = np.pi * (rng.random(len(self)) < 0.5)
        flip[self.rim] = 0.0
        spread = np.pi * np.exp(-100.0 * self.anisotropy**2)
        angle = flip + spread * rng.standard_normal(len(self))
        z = np.broadcast_to(np.array([0.0, 0.0, 1.0]), (len(self), 3))
        return Pose(self.p, quat_multiply(self.q, quat_about_axis(z, angle)))


@one_blas_thread
def compute_features(
    cloud: PointCloud, parameters: FeatureParameters | None = None
) -> SurfaceFeatures:
    """Compute the surface features of a cloud, one per occupied voxel.

    Steps:

    1. Downsample to voxels.
    2. Fit a plane to each neighbourhood (principal component analysis): the normal.
    3. Orient the normals: towards the viewpoint if known, else consistently over the cloud.
    4. Regress tangential normal components on tangential offsets: the Weingarten map, whose
       eigenvalues and eigenvectors are the principal curvatures and directions.
    5. Find the rims.

    Parts thinner than rho, such as a teapot's handle, are inside one ball: their normals are
    unreliable, and some of their points are classified as rim.

    Parameters
    ----------
    cloud : PointCloud
        A cloud; in its canonical frame, the features' order is canonical too.
    parameters : FeatureParameters, optional
        Radius, voxel and thresholds.

    Returns
    -------
    SurfaceFeatures
        In the cloud's frame, without points that have too few neighbours. Without voxels, they
        keep the order of the points.

    Raises
    ------
    InputError
        If neighbouring points are more than 2/3 rho apart, or no part of the cloud has
        `min_neighbours` points within rho of each of its points.

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
        order = np.arange(len(cloud))
    else:
        # Points of a raw cloud have any order; voxels are sorted already.
        order = order_by_place(cloud.points, 2.0 * parameters.rho)
    rho, fewest = parameters.rho, parameters.min_neighbours
    sampled = check_sampling(cloud, rho, fewest, parameters.voxel_size)
    planes = fit_planes(cloud.points[order], parameters.rho, parameters.min_neighbours)
    if planes is None:
        raise InputError(
            f"too few points: none of {len(cloud)} has {parameters.min_neighbours} neighbours "
            f"within rho = {parameters.rho:g} m; {remedy(cloud)}"
        )
    balls, normals, kept = planes
    points = balls.points
    normals, oriented = _outward(cloud, points, normals, parameters.rho)
    t1 = perpendicular(normals)
    curvature = Curvature.of(balls, normals, t1, parameters.rim_offset)
    q, r, anisotropy = _frames(curvature, normals, t1, parameters)
    features = SurfaceFeatures(
        points,
        q,
        r,
        anisotropy,
        curvature.rim,
        parameters.rho,
        parameters.edge_saliency,
        sampled + oriented,
    )
    return features if parameters.voxel_size > 0.0 else features.take(np.argsort(order[kept]))


def _frames(
    curvature: Curvature, normals: Array, t1: Array, parameters: FeatureParameters
) -> tuple[Array, Array, Array]:
    """Return frames (N, 4), descriptors r (N, 2) and anisotropies (N,) of features."""
    r = curvature.kappa * parameters.rho
    magnitude = np.abs(r)
    anisotropy = (magnitude[:, 0] - magnitude[:, 1]) / np.maximum(
        magnitude[:, 0], parameters.anisotropy_floor
    )
    anisotropy = np.where(curvature.rim, 1.0, anisotropy)
    # Where the curvatures are equal except for rounding, a fixed tangent is reproducible.
    umbilic = magnitude[:, 0] - magnitude[:, 1] < _ROUNDING
    x = np.where(
        curvature.rim[:, None], curvature.outward, np.where(umbilic[:, None], t1, curvature.k1)
    )
    return quat_from_xz(x, normals), r, anisotropy


def _outward(
    cloud: PointCloud, points: Array, normals: Array, rho: float
) -> tuple[Array, tuple[Assumption, ...]]:
    """Return the normals with outward signs, and what was assumed about a given viewpoint."""
    if cloud.viewpoint is None:
        normals = orientation.consistently(points, normals, cloud.up, rho)
        return orientation.facing_out_of_plates(points, normals, rho), ()
    hidden = orientation.hidden_points(points, normals, cloud.viewpoint, rho)
    if hidden.mean() <= _HIDDEN:
        normals = orientation.towards_viewpoint(points, normals, cloud.viewpoint)
        return orientation.facing_out_of_plates(points, normals, rho), ()
    text = (
        f"{100 * hidden.mean():.0f} % of the scan are hidden from the viewpoint; "
        "their outside is found from the rest of the scan"
    )
    outward = orientation.consistently(
        points, normals, cloud.up, rho, visible=~hidden, viewpoint=cloud.viewpoint
    )
    outward = orientation.facing_out_of_plates(points, outward, rho)
    return outward, (Assumption(AssumptionKind.OUTSIDE, text),)
