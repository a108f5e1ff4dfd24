"""Mass properties: uniform solids bounded by triangles, and the check of an inertia."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array


class SolidProperties(NamedTuple):
    """Volume properties of a solid of uniform density.

    Attributes
    ----------
    volume : float
        [m^3]; negative if the triangles point inwards.
    centroid : (3,) array
        Volume centroid in the vertices' frame [m].
    covariance : (3, 3) array
        Mean of (x - centroid)(x - centroid)^T over the volume [m^2].
    """

    volume: float
    centroid: Array
    covariance: Array

    def inertia(self, mass: float) -> Array:
        """Return the inertia (3, 3) about the centroid [kg m^2] for a `mass` [kg]."""
        return mass * (np.trace(self.covariance) * np.eye(3) - self.covariance)


def solid_properties(vertices: Array, faces: Array) -> SolidProperties:
    """Integrate a closed triangle mesh by signed tetrahedra from its mean vertex.

    Parameters
    ----------
    vertices : (V, 3) array [m]
    faces : (F, 3) int array
    """
    centre = vertices.mean(axis=0)
    a, b, c = np.moveaxis((vertices - centre)[faces], 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    volume = float(volumes.sum())
    if volume == 0.0:
        return SolidProperties(0.0, centre, np.zeros((3, 3)))
    total = a + b + c
    mean = np.einsum("i,ij->j", volumes, total) / (4.0 * volume)
    # Second moment of a tetrahedron with a corner at the origin: V/20 (sum x x^T + s s^T).
    second = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (a, b, c, total)) / (
        20.0 * volume
    )
    return SolidProperties(volume, centre + mean, second - np.outer(mean, mean))


def is_closed(faces: Array) -> bool:
    """Return whether the triangles (F, 3) close: each edge occurs once in either direction."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forward, n_forward = np.unique(edges, axis=0, return_counts=True)
    backward, n_backward = np.unique(edges[:, ::-1], axis=0, return_counts=True)
    return forward.shape == backward.shape and bool(
        (forward == backward).all() and (n_forward == n_backward).all()
    )


def check_inertia(inertia: ArrayLike, what: str = "inertia") -> Array:
    """Return a rotational inertia as a matrix (3, 3) after checking that it is possible.

    Parameters
    ----------
    inertia : (3,) or (3, 3)
        Principal moments or matrix about the centre of mass [kg m^2].
    what : str
        Name of the value, for the error.

    Raises
    ------
    InputError
        If it is not symmetric positive definite, or if one principal moment exceeds the sum of the
        other two, which is impossible for any distribution of mass.
    """
    try:
        given = np.asarray(inertia, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{what} must be three moments or a 3x3 matrix, got {inertia!r}"
        ) from error
    matrix = np.diag(given) if given.shape == (3,) else given
    if (
        matrix.shape != (3, 3)
        or not np.isfinite(matrix).all()
        or not np.allclose(matrix, matrix.T, rtol=1e-6)
    ):
        raise InputError(
            f"{what} must be three moments or a symmetric 3x3 matrix [kg m^2], got {inertia!r}"
        )
    moments = np.linalg.eigvalsh(matrix)
    if moments[0] <= 0.0:
        raise InputError(
            f"{what} must have positive principal moments [kg m^2], got {moments[0]:.4g}"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
        diagonal = np.diag(matrix)
        k = int(np.argmax(diagonal))
        others = diagonal.sum() - diagonal[k]
        named = f"J_{'xyz'[k]}{'xyz'[k]} = {diagonal[k]:g}"
        message = (
            f"{what} is impossible: {named} exceeds the sum {others:g} of the other two moments"
            if diagonal[k] > others
            else f"{what} is impossible: its largest principal moment {moments[2]:g} exceeds the "
            f"sum {moments[0] + moments[1]:g} of the other two"
        )
        # The published parameter table prints J_zz = 0.107 beside 0.006 and 0.0059.
        if np.isclose(diagonal[2], 0.107) and np.allclose(diagonal[:2], [0.006, 0.0059]):
            message += "; use 0.0107 where the published table prints 0.107"
        raise InputError(message)
    return 0.5 * (matrix + matrix.T)
