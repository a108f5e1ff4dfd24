"""Principal curvatures and rims of a cloud with known normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_aerial.features.neighbourhoods import BallNeighbourhoods, Batch, dot
from drake_aerial.geometry import Array, cross

# Neighbours whose normals have a smaller dot product are on the other side of a thin wall.
_OTHER_SHEET = -0.8
# Two normals that both have a larger dot product with a third are on the same side.
_ONE_SHEET = float(np.cos(0.5 * np.arccos(_OTHER_SHEET)))
# Fraction of a rim's neighbours that may lie beyond it by more than a fraction of the radius.
_BEYOND_RIM, _BEYOND_DISTANCE = 0.05, 0.4
_UPPER = np.triu_indices(3)


@dataclass(frozen=True, eq=False)
class Curvature:
    """Curvatures at the N points of a cloud.

    Attributes
    ----------
    kappa : (N, 2) array
        Principal curvatures [1/m], the one of larger magnitude first, convex positive.
    k1 : (N, 3) array
        Unit direction of the first.
    outward : (N, 3) array
        Unit tangent away from the neighbours' mean; k1 where the mean is at the point.
    rim : (N,) bool array
        True where the neighbours lie on one side of the point.
    """

    kappa: Array
    k1: Array
    outward: Array
    rim: NDArray[np.bool_]

    @classmethod
    def of(
        cls, balls: BallNeighbourhoods, normals: Array, t1: Array, rim_offset: float
    ) -> Curvature:
        """Fit the Weingarten map: tangential normal components over tangential offsets.

        Parameters
        ----------
        balls : BallNeighbourhoods
            Neighbourhoods of the cloud's N points.
        normals, t1 : (N, 3) arrays
            Outward unit normals, and any unit tangents.
        rim_offset : float
            Tangential offset of the neighbours' mean, as a fraction of the radius, beyond which a
            neighbourhood is one-sided.
        """
        count = len(normals)
        kappa, k1, outward = np.empty((count, 2)), np.empty((count, 3)), np.empty((count, 3))
        rim = np.empty(count, dtype=bool)

        columns = np.ascontiguousarray(normals.T)

        def fit(batch: Batch) -> None:
            at = batch.points
            n_row, n_candidate = (
                columns.take(batch.rows, axis=1),
                columns.take(batch.candidates, axis=1),
            )
            inside = _same_side(batch.inside, n_row, n_candidate)
            found = _fit(batch, inside, n_candidate, normals[at], t1[at], balls.radius, rim_offset)
            kappa[at], k1[at], outward[at], rim[at] = found

        balls.for_each(fit)
        return cls(kappa, k1, outward, rim)


def _fit(
    batch: Batch,
    inside: NDArray[np.bool_],
    n_candidate: Array,
    normal: Array,
    t1: Array,
    radius: float,
    rim_offset: float,
) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Return curvatures (M, 2), k1 (M, 3), outward directions (M, 3) and rim (M,) of a batch.

    `inside` (T, m, c) marks the neighbours used, `n_candidate` (3, T, c) are the candidates'
    normals, `normal` and `t1` (M, 3) the points' normals and tangents.
    """
    p, n = batch.p_candidate, n_candidate
    values = np.empty((22, *p.shape[1:]))
    values[0], values[1:4], values[4:7] = 1.0, p, n
    for k, (i, j) in enumerate(zip(*_UPPER, strict=True)):
        np.multiply(p[i], p[j], out=values[7 + k])
    np.multiply(n[:, None], p, out=values[13:].reshape(3, *p.shape))
    sums = batch.sums(values, inside)
    count, p_sum, n_sum = sums[:, :1], sums[:, 1:4], sums[:, 4:7]
    pp = np.empty((len(sums), 3, 3))
    pp[:, _UPPER[0], _UPPER[1]] = pp[:, _UPPER[1], _UPPER[0]] = sums[:, 7:13]
    # The regression has an intercept, so that an error of the point's own normal cancels.
    base = p_sum / count
    spread = pp - p_sum[:, :, None] * base[:, None, :]
    turning = sums[:, 13:].reshape(-1, 3, 3) - n_sum[:, :, None] * base[:, None, :]
    tangents = np.stack([t1, cross(normal, t1)], axis=1)
    spread_T = tangents @ spread @ tangents.transpose(0, 2, 1)
    turning_T = tangents @ turning @ tangents.transpose(0, 2, 1)
    # A small ridge: without neighbours, or with all of them on a line, the curvature is zero.
    spread_T += 1e-6 * radius**2 * np.eye(2)
    weingarten = np.linalg.solve(spread_T, turning_T.transpose(0, 2, 1))
    kappa, direction = np.linalg.eigh(0.5 * (weingarten + weingarten.transpose(0, 2, 1)))
    first = np.argmax(np.abs(kappa), axis=1)
    rows = np.arange(len(kappa))
    k1 = np.einsum("ni,nij->nj", direction[rows, :, first], tangents)
    kappa = np.stack([kappa[rows, first], kappa[rows, 1 - first]], axis=1)

    here = batch.p_row[:, batch.used].T
    offset = base - here
    offset -= np.sum(offset * normal, axis=1, keepdims=True) * normal
    distance = np.linalg.norm(offset, axis=1)
    outward = np.where(
        distance[:, None] > 1e-12, -offset / np.maximum(distance, 1e-12)[:, None], k1
    )
    rim = distance > rim_offset * radius
    asked = np.flatnonzero(rim)
    if len(asked):
        # Sparse samples are one-sided by chance; a rim has almost no neighbours on the outer side.
        tile, row = (index[asked] for index in np.nonzero(batch.used))
        ahead = dot(p[:, tile] - here[asked].T[:, :, None], outward[asked].T[:, :, None])
        beyond = np.sum(inside[tile, row] & (ahead > _BEYOND_DISTANCE * radius), axis=1)
        rim[asked] = beyond <= _BEYOND_RIM * count[asked, 0]
    return kappa, k1, outward, rim


def _same_side(inside: NDArray[np.bool_], n_row: Array, n_candidate: Array) -> NDArray[np.bool_]:
    """Return a mask (T, m, c) of the neighbours on the same side of a thin wall.

    `n_row` (3, T, m) and `n_candidate` (3, T, c) are normals.
    """
    mean = n_row.mean(axis=2, keepdims=True)
    mean /= np.maximum(np.sqrt(dot(mean, mean)), 1e-12)
    lean = np.minimum(*(dot(n, mean).min(axis=1) for n in (n_row, n_candidate)))
    doubtful = np.flatnonzero(lean < _ONE_SHEET + 1e-9)
    if len(doubtful) == 0:
        return inside
    same_side = inside.copy()
    agreement = n_row[:, doubtful].transpose(1, 2, 0) @ n_candidate[:, doubtful].transpose(1, 0, 2)
    same_side[doubtful] &= agreement > _OTHER_SHEET
    return same_side
