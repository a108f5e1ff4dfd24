"""Outward signs of normals: towards a known sensor, else consistent over the cloud."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, triu
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from drake_aerial.features.neighbourhoods import dot
from drake_aerial.geometry import Array
from drake_aerial.parallel import cores, for_each

_NEIGHBOURS = 12
_DIRECTIONS = 128
# Weights of "outward is up" and "outward is away from the centroid"; extremal points have 1.
_UP_WEIGHT = 3.0
_AWAY_WEIGHT = 0.25
# Points at which plates are searched, and the fraction with a second layer that makes a plate.
_LAYER_SAMPLE, _LAYERED = 300, 0.25
# Heights above this fraction of the radius belong to another layer.
_LAYER_HEIGHT = 0.15
# Number of edges in a parallel chunk, whose arrays fit the cache.
_EDGES = 8192


def towards_viewpoint(points: Array, normals: Array, viewpoint: Array) -> Array:
    """Return the normals (N, 3), each with the sign that faces `viewpoint` (3,) [m]."""
    away = np.sum(normals * (viewpoint - points), axis=1) < 0.0
    return np.where(away[:, None], -normals, normals)


def hidden_points(
    points: Array, normals: Array, viewpoint: Array, radius: float
) -> NDArray[np.bool_]:
    """Return a mask (N,) of the points that other points hide from a sensor at `viewpoint` (3,).

    A point is hidden if a point on the same ray is nearer to the sensor, and at least half the
    radius off its own tangent plane: on a surface seen at a small angle, no point hides another.

    Parameters
    ----------
    points, normals : (N, 3) arrays
        Points [m] and unit normals of arbitrary sign.
    viewpoint : (3,) array
        Position of the sensor [m].
    radius : float
        Radius of the feature neighbourhoods [m]; rays half of it apart are one.
    """
    ray = points - viewpoint
    distance = np.linalg.norm(ray, axis=1)
    width = 0.5 * radius / max(float(np.median(distance)), radius)
    cell = np.floor((ray / np.maximum(distance, 1e-9)[:, None] + 1.0) / width).astype(np.int64)
    base = int(2.0 / width) + 2
    key = (cell[:, 0] * base + cell[:, 1]) * base + cell[:, 2]
    order = np.lexsort((distance, key))
    starts = np.append(True, np.diff(key[order]) != 0)
    nearest = np.empty(len(points), dtype=np.int64)
    nearest[order] = order[starts][np.cumsum(starts) - 1]
    off_plane = np.abs(np.sum(normals * (points - points[nearest]), axis=1))
    hidden: NDArray[np.bool_] = off_plane > 0.5 * radius
    return hidden


def facing_out_of_plates(points: Array, normals: Array, radius: float) -> Array:
    """Return the normals of a thin plate's two faces with signs that point out of the plate.

    Neighbourhoods hold both faces of a plate that is thinner than the radius, and signs propagate
    from one to the other unchanged. The faces show as two layers: where at least a quarter of the
    points have another layer on one side, each of those points faces the other way.

    Parameters
    ----------
    points, normals : (N, 3) arrays
        Points [m] and unit normals.
    radius : float
        Radius of the feature neighbourhoods [m].
    """
    tree = cKDTree(points)
    sample = np.unique(np.linspace(0, len(points) - 1, _LAYER_SAMPLE).astype(int))
    if np.mean(_other_layer(tree, normals, sample, radius) != 0.0) < _LAYERED:
        return normals
    side = _other_layer(tree, normals, np.arange(len(points)), radius)
    outward = np.where(side[:, None] > 0.0, -normals, normals)
    # At the plate's border, a point takes the sign of its own face: the nearest one in height.
    layered, border = np.flatnonzero(side), np.flatnonzero(side == 0.0)
    distance, nearest = cKDTree(points[layered]).query(points[border], k=_NEIGHBOURS)
    nearest = layered[np.minimum(nearest, len(layered) - 1)]
    height = np.abs(
        np.einsum("mkj,mj->mk", points[nearest] - points[border, None], normals[border])
    )
    height[distance > radius] = np.inf
    best = np.argmin(height, axis=1)
    rows = np.arange(len(border))
    chosen = nearest[rows, best]
    agreement = np.sum(outward[chosen] * normals[border], axis=1)
    turn = (height[rows, best] < _LAYER_HEIGHT * radius) & (agreement < -0.5)
    outward[border[turn]] *= -1.0
    return outward


def _other_layer(tree: cKDTree, normals: Array, at: NDArray[np.int64], radius: float) -> Array:
    """Return the side (M,) of another layer at points `at`: +1 along the normal, -1, or 0."""
    points = tree.data
    neighbours = tree.query_ball_point(points[at], radius, workers=cores())
    row = np.repeat(np.arange(len(at)), [len(found) for found in neighbours])
    column = np.concatenate(neighbours).astype(np.int64)
    offset = points[column] - points[at[row]]
    height = np.sum(offset * normals[at[row]], axis=1)
    near = np.sum(offset**2, axis=1) - height**2 < (0.5 * radius) ** 2
    row, height = row[near], height[near] / radius

    def count(mask: NDArray[np.bool_]) -> Array:
        return np.bincount(row[mask], minlength=len(at)).astype(np.float64)

    above, below = count(height > _LAYER_HEIGHT), count(height < -_LAYER_HEIGHT)
    total = count(np.ones(len(row), dtype=bool))
    side = np.zeros(len(at))
    side[(above > 0.3 * total) & (below < 0.05 * total)] = 1.0
    side[(below > 0.3 * total) & (above < 0.05 * total)] = -1.0
    # On an edge or a curved surface, heights are spread; two layers leave a gap.
    reach = np.bincount(row, np.abs(height), minlength=len(at)) / np.maximum(above + below, 1.0)
    between = count((np.abs(height) > 0.25 * reach[row]) & (np.abs(height) < 0.75 * reach[row]))
    side[between > 0.1 * total] = 0.0
    return side


def consistently(
    points: Array,
    normals: Array,
    up: Array,
    radius: float,
    *,
    visible: NDArray[np.bool_] | None = None,
    viewpoint: Array | None = None,
) -> Array:
    """Return the normals with consistent signs, outward.

    Signs propagate along a minimum spanning tree of the neighbourhood graph (Hoppe et al. 1992).
    The weight of a graph edge and the sign across it follow the circle through both points that
    one of the normals fixes (Koenig and Gumhold 2009). So a box's edges and thin walls get right
    signs. The sign of each connected part is then selected by the sum of three criteria: at points
    that are extremal in a direction, the normal has that direction (exact on a closed surface,
    also a concave one); normals are up on average (zero on a closed surface); and, with a small
    weight, normals point away from the cloud's centroid.

    Parameters
    ----------
    points, normals : (N, 3) arrays
        Points [m] and unit normals of arbitrary sign.
    up : (3,) array
        Unit vector against gravity.
    radius : float
        Points further apart than this [m] are not neighbours.
    visible : (N,) bool array, optional
        Points that a sensor at `viewpoint` sees. Parts of the cloud with such points get the sign
        by which those face the sensor.
    viewpoint : (3,) array, optional
        Position of the sensor [m].

    Returns
    -------
    (N, 3) array
        The normals, some of them negated.
    """
    graph = _sign_graph(points, normals, radius)
    count, part = connected_components(graph, directed=False)
    tree = minimum_spanning_tree(graph)
    oriented = normals * _spread(points, normals, tree, part, count)[:, None]
    sign = _outward_sign(points, oriented, up, part, count)
    if visible is not None and viewpoint is not None:
        facing = np.sum(oriented * (viewpoint - points), axis=1)
        score = np.bincount(part[visible], facing[visible], minlength=count)
        sign = np.where(score == 0.0, sign, np.sign(score))
    return oriented * sign[part][:, None]


def _sign_graph(points: Array, normals: Array, radius: float) -> csr_matrix:
    """Return the neighbourhood graph; a large weight means that the relative sign is uncertain."""
    count = len(points)
    nearest = min(_NEIGHBOURS + 1, count)
    distance, neighbour = cKDTree(points).query(
        points, k=nearest, distance_upper_bound=radius, workers=cores()
    )
    near = np.isfinite(distance[:, 1:])
    i = np.repeat(np.arange(count), near.sum(axis=1))
    j = neighbour[:, 1:][near]
    agreement, along = _transport(points, normals, i, j)
    # Along the normal, the circle is degenerate, and the offset is noise or another wall.
    doubt = (1.0 - np.abs(agreement)) + along**2
    # Rounded, so that the last bits do not select the tree on flat faces, where all weights are
    # zero. Positive, since a zero in a sparse graph means no edge.
    weight = np.round(np.maximum(doubt, 0.0), 9) + 1e-9
    graph = csr_matrix((weight, (i, j)), shape=(count, count))
    # Each edge once: the searches treat the graph as undirected, and sort its edges.
    return triu(graph.maximum(graph.T), format="csr")


def _transport(
    points: Array, normals: Array, i: NDArray[np.int64], j: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Return n_j . n_i' and the offset along n_i; n_i' is n_i moved along a circle to j."""
    # Arrays (3, N) are several times as fast as (N, 3).
    p, n = points.T.copy(), normals.T.copy()
    agreement, along = np.empty(len(i)), np.empty(len(i))

    def carry(edges: slice) -> None:
        offset = p.take(j[edges], axis=1) - p.take(i[edges], axis=1)
        offset /= np.maximum(np.sqrt(dot(offset, offset)), 1e-300)
        n_i, n_j = n.take(i[edges], axis=1), n.take(j[edges], axis=1)
        along_i, along_j = dot(offset, n_i), dot(offset, n_j)
        agreement[edges] = dot(n_i, n_j) - 2.0 * along_i * along_j
        along[edges] = np.maximum(np.abs(along_i), np.abs(along_j))

    for_each(carry, [slice(start, start + _EDGES) for start in range(0, len(i), _EDGES)])
    return agreement, along


def _spread(
    points: Array, normals: Array, tree: csr_matrix, part: NDArray[np.int32], count: int
) -> Array:
    """Return a sign (N,) per normal, carried from each part's first point along the tree."""
    size = len(points)
    roots = np.full(count, -1)
    roots[part[::-1]] = np.arange(size)[::-1]
    # One more node joins the parts, so that a single search orders them all.
    joined = tree.tocoo()
    rows = np.concatenate([joined.row, np.full(count, size)])
    columns = np.concatenate([joined.col, roots])
    forest = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(size + 1, size + 1))
    parent = breadth_first_order(forest, size, directed=False)[1][:size].astype(np.int64)
    sign = np.ones(size + 1)
    child = np.flatnonzero(parent != size)
    agreement, _ = _transport(points, normals, parent[child], child)
    sign[child] = np.where(agreement < 0.0, -1.0, 1.0)
    ancestor = np.append(parent, size)
    # Pointer doubling: after k rounds a sign is the product over 2^k edges towards the root.
    while (ancestor != size).any():
        sign *= sign[ancestor]
        ancestor = ancestor[ancestor]
    return sign[:size]


def _outward_sign(
    points: Array, normals: Array, up: Array, part: NDArray[np.int32], count: int
) -> Array:
    """Return +1 or -1 (count,) per connected part of a consistently oriented cloud."""
    size = np.bincount(part, minlength=count)
    centroid = points.mean(axis=0)
    away = points - centroid
    away /= np.maximum(np.linalg.norm(away, axis=1), 1e-12)[:, None]
    score = _UP_WEIGHT * np.bincount(part, normals @ up, minlength=count) / size
    score += (
        _AWAY_WEIGHT * np.bincount(part, np.sum(normals * away, axis=1), minlength=count) / size
    )
    directions = _sphere_directions(_DIRECTIONS)
    members = np.split(np.argsort(part, kind="stable"), np.cumsum(size)[:-1])
    for k, member in enumerate(members):
        p = np.ascontiguousarray(points[member].T)
        for batch in np.split(
            directions, _DIRECTIONS // 16
        ):  # bounds the (directions, points) array
            extremal = member[np.argmax(batch @ p, axis=1)]
            score[k] += np.sum(normals[extremal] * batch) / _DIRECTIONS
    return np.where(score < 0.0, -1.0, 1.0)


def _sphere_directions(count: int) -> Array:
    """Return `count` unit vectors spread evenly over the sphere (Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
