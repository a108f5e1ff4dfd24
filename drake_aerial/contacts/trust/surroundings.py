"""Fit of the demonstrated object to a new scan if its contact is at a given place.

Only what is visible from above is compared. No density and no vote is used, so that it also speaks
about contacts that a method found likely for the wrong reason. The demonstrated object itself has
the value zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from drake_aerial.contacts.trust.top_surface import TopSurface
from drake_aerial.geometry import Array

# Numbers of points that are looked up, first with all maps and then with the best ones.
_FEW, _MANY = 80, 300
# Number of points of either surface among which the nearest is sought.
_SURFACE = 3000
# Distances up to this many spacings of the points are none.
_SPACINGS = 0.8
# Distances are cut off at this share of the new object's size.
_CAP = 0.08
# Radius of the near surroundings, as a share of the new object's size.
NEAR = 0.3
# Misfit of a map that stretches one side e times as much as the other, as a share of the size.
_STRETCH = 0.01
# Number of maps of each place that are compared with many points.
_KEPT = 2


@dataclass(frozen=True, eq=False)
class Fit:
    """Distances of the demonstrated object from the new scan, aligned at one place.

    Attributes
    ----------
    whole, near : float
        Mean distance between the two surfaces in both directions, over the whole object and within
        30 % of its size of the contact, as shares of the size. `whole` has 1 % more for a map that
        stretches one side e times as much as the other.
    unexplained : float
        Mean distance of the new scan's points from the demonstrated surface, as a share of the
        size. A part that the scan does not show leaves it unchanged.
    yaw : float
        Yaw of the demonstrated object on the new one [rad].
    """

    whole: float
    near: float
    unexplained: float
    yaw: float


class Surroundings:
    """The demonstrated object relative to its contact, to be aligned with a new scan.

    Each quarter turn between the two upright boxes gives three maps: stretched to the new box, and
    in proportion, as long or as wide as the new box.

    Parameters
    ----------
    source : TopSurface
        The demonstrated object.
    site : (3,) array
        The demonstrated contact, or the mean of several [m].
    target : TopSurface
        The new scan.
    """

    def __init__(self, source: TopSurface, site: Array, target: TopSurface):
        self._size = target.box.size
        self.maps, self.yaws = maps_between(source, target)
        sides = np.linalg.svd(self.maps[:, :2, :2], compute_uv=False)
        self._misfit = _STRETCH * np.log(sides[:, 0] / sides[:, 1])
        taught = _spread(source.points, _SURFACE) - site
        asked = _spread(target.points, _SURFACE)
        self._taught, self._asked = cKDTree(taught), cKDTree(asked)
        self._spacing = _spacing(self._taught), _spacing(self._asked)
        self._looked_up = {n: (_spread(taught, n), _spread(asked, n)) for n in (_FEW, _MANY)}

    def fit(self, place: Array) -> Fit:
        """Return the fit of the best of `maps` if the contact is at `place` (3,) [m]."""
        rough = [
            0.5 * sum(map(np.mean, self._shares(m, place, _FEW))) + misfit
            for m, misfit in zip(self.maps, self._misfit, strict=True)
        ]
        fits = [self._fit(int(k), place) for k in np.argsort(rough, kind="stable")[:_KEPT]]
        return min(fits, key=lambda fit: fit.whole)

    def fit_of(self, k: int, place: Array) -> float:
        """Return `Fit.whole` of `maps[k]` if the contact is at `place` (3,) [m]."""
        return self._fit(k, place).whole

    def _fit(self, k: int, place: Array) -> Fit:
        there, back = self._shares(self.maps[k], place, _MANY)
        taught, asked = self._looked_up[_MANY]
        reach = NEAR * self._size
        near = [
            float(np.mean(distance[mask])) if mask.any() else _CAP
            for distance, mask in (
                (there, np.linalg.norm(taught @ self.maps[k].T, axis=1) < reach),
                (back, np.linalg.norm(asked - place, axis=1) < reach),
            )
        ]
        return Fit(
            whole=0.5 * float(there.mean() + back.mean()) + float(self._misfit[k]),
            near=0.5 * sum(near),
            unexplained=float(back.mean()),
            yaw=float(self.yaws[k]),
        )

    def _shares(self, stretch: Array, place: Array, count: int) -> tuple[Array, Array]:
        """Return distances of demonstrated points and of scan points from the other surface.

        They are shares of the size, without the spacing of the points, and at most a cap.
        """
        taught, asked = self._looked_up[count]
        there, _ = self._asked.query(taught @ stretch.T + place)
        # The nearest point is sought in the demonstration's coordinates, and measured in the scan.
        back_in = (asked - place) @ np.linalg.inv(stretch).T
        _, nearest = self._taught.query(back_in)
        back = np.linalg.norm((back_in - self._taught.data[nearest]) @ stretch.T, axis=1)
        spacing = self._spacing[0] * float(np.linalg.norm(stretch, 2))
        return self._capped(there - _SPACINGS * self._spacing[1]), self._capped(
            back - _SPACINGS * spacing
        )

    def _capped(self, distance: Array) -> Array:
        return np.clip(distance / self._size, 0.0, _CAP)


def _spacing(tree: cKDTree) -> float:
    """Return the median distance between neighbouring points [m]."""
    points = tree.data[:: max(len(tree.data) // 300, 1)]
    return float(np.median(tree.query(points, k=2)[0][:, 1]))


def maps_between(source: TopSurface, target: TopSurface) -> tuple[Array, Array]:
    """Return linear maps (12, 3, 3) from a demonstrated object to a new one, and yaws (12,) [rad].

    Heights are stretched as the reliefs compare, or as the lengths where either object is flat.
    """
    flat = source.is_flat() or target.is_flat()
    maps, yaws = [], []
    for turns in range(4):
        half = source.box.half if turns % 2 == 0 else source.box.half[[1, 0, 2]]
        long, wide = target.box.half[:2] / half[:2]
        quarter = _about_z(0.5 * np.pi * turns - source.box.yaw)
        yaw = target.box.yaw + 0.5 * np.pi * turns - source.box.yaw
        high = np.sqrt(long * wide) if flat else target.relief / source.relief
        maps += [
            _about_z(target.box.yaw) @ np.diag([long, wide, high]) @ quarter,
            _about_z(yaw) @ np.diag([long, long, long]),
            _about_z(yaw) @ np.diag([wide, wide, wide]),
        ]
        yaws += [yaw] * 3
    return np.array(maps), np.array(yaws)


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _spread(points: Array, count: int) -> Array:
    """Return at most `count` of the points (N, 3), evenly spaced in their order."""
    index = np.linspace(0, len(points) - 1, min(count, len(points))).astype(int)
    return points[index]
