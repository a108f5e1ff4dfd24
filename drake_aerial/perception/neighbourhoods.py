"""Ball neighbourhoods of every point, as sparse matrices: sums over neighbours become matrix products."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

# Points per block: bounds the memory of a block's pairs (some hundred bytes each) whatever the cloud's size.
_BLOCK = 150_000


@dataclass(frozen=True, eq=False)
class Block:
    """The neighbours of a contiguous run of points.

    Attributes
    ----------
    rows : slice
        The points whose neighbours these are (m of them).
    indptr, indices : (m + 1,) and (pairs,) int arrays
        Row k's neighbours, itself included, are `indices[indptr[k]:indptr[k + 1]]`.
    shape : (int, int)
        m and the number of points of the cloud.
    """

    rows: slice
    indptr: NDArray[np.int64]
    indices: NDArray[np.int32]
    shape: tuple[int, int]

    @property
    def owners(self) -> NDArray[np.int64]:
        """For every pair, the index in the cloud of the point whose neighbour it is, (pairs,)."""
        return np.repeat(np.arange(self.rows.start, self.rows.stop), np.diff(self.indptr))

    def matrix(self, keep: NDArray[np.bool_] | None = None) -> csr_matrix:
        """Return the (m, N) matrix of ones at the neighbours; `keep` (pairs,) leaves some out."""
        data = np.ones(len(self.indices)) if keep is None else keep.astype(np.float64)
        return csr_matrix((data, self.indices, self.indptr), shape=self.shape)


class BallNeighbourhoods:
    """The neighbours within a radius of every point of a cloud, block by block.

    Parameters
    ----------
    points : (N, 3) array
        Points [m].
    radius : float
        Radius of the ball [m].
    """

    def __init__(self, points: Array, radius: float) -> None:
        self.points = points
        self.radius = radius
        self.tree = cKDTree(points)
        self._only: Block | None = None

    def blocks(self) -> Iterator[Block]:
        """Yield the blocks in order. A cloud of one block keeps it; larger ones search again, to bound memory."""
        count = len(self.points)
        if count <= _BLOCK:
            if self._only is None:
                self._only = self._search(slice(0, count))
            yield self._only
            return
        for start in range(0, count, _BLOCK):
            yield self._search(slice(start, min(start + _BLOCK, count)))

    def counts(self) -> NDArray[np.int64]:
        """Return the number of neighbours of every point, itself included, (N,)."""
        return np.concatenate([np.diff(block.indptr) for block in self.blocks()])

    def _search(self, rows: slice) -> Block:
        count = rows.stop - rows.start
        if count == len(self.points):
            pairs = self.tree.query_pairs(self.radius, output_type="ndarray")
            itself = np.arange(count)
            owner = np.concatenate([pairs[:, 0], pairs[:, 1], itself])
            other = np.concatenate([pairs[:, 1], pairs[:, 0], itself])
        else:
            part = cKDTree(self.points[rows])
            found = part.sparse_distance_matrix(self.tree, self.radius, output_type="ndarray")
            owner, other = found["i"], found["j"]
        ones = np.ones(len(owner), dtype=np.int8)
        shape = (count, len(self.points))
        # Made from coordinates, it comes with sorted neighbours: the sums' rounding does not depend on the tree.
        matrix = csr_matrix((ones, (owner, other)), shape=shape)
        return Block(rows, matrix.indptr, matrix.indices, shape)
