"""Cases of the generated shapes: a demonstration, and the scan of another object of its kind."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scans import placed
from shape_family import KINDS
from shape_parts import Shape

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.geometry import Pose, invert, quat_about_axis, rotate, transform
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn

CORRUPTIONS = ("noise", "flying", "misregistered", "tilt", "sparse", "dense")
CONDITIONS = ("clean", *CORRUPTIONS, "cut", "camera")
# Area of a full scan's surface per point [m^2], and limits of the number of points.
_PER_POINT, _FEWEST, _MOST = 0.009**2, 6_000, 40_000
# Share of the points that a cut takes away.
CUT = 0.38


def success_limit(size: float) -> float:
    """Return the distance within which a contact is right [m]: 5 % of the size, at least 1.5 cm."""
    return max(0.015, 0.05 * size)


def seed_of(text: str) -> int:
    """Return a seed that a text fixes, such as a commit's hash."""
    return int(hashlib.sha256(text.encode()).hexdigest()[:8], 16)


@dataclass(frozen=True)
class Case:
    """One case: a kind, its site, a condition of the scan, and a seed.

    `master` is the seed of the whole table, `taught_by` the condition of the demonstration's scan.
    All draws follow from these values alone.
    """

    kind: str
    site: str
    condition: str
    seed: int
    master: int = 0
    taught_by: str = "clean"

    @property
    def key(self) -> str:
        """Name of the case in records."""
        return f"{self.kind}/{self.site}/{self.condition}/{self.seed}/{self.master}"

    def _rng(self, purpose: int) -> np.random.Generator:
        words = [self.master, seed_of(self.kind), seed_of(self.site), self.seed, purpose]
        return np.random.default_rng(words)

    def _shapes(self) -> tuple[Shape, Shape]:
        rng = self._rng(0)
        kind = KINDS[self.kind]
        low, high = kind.extent
        # People teach on objects of a handy size; new ones are up to three times larger or smaller.
        taught = np.exp(rng.uniform(*np.log([max(low, 0.25), min(high, 1.0)])))
        asked = np.exp(rng.uniform(*np.log([max(low, taught / 3.0), min(high, 3.0 * taught)])))
        return kind.make(rng, float(taught)), kind.make(rng, float(asked))

    @cached_property
    def taught(self) -> Shape:
        """The object of the demonstration."""
        return self._shapes()[0]

    @cached_property
    def asked(self) -> Shape:
        """The new object."""
        return self._shapes()[1]

    @cached_property
    def skill(self) -> ContactSkill:
        """The skill of the demonstration."""
        rng = self._rng(1)
        place, normal = self.taught.places(self.site)
        k = int(rng.integers(len(place)))
        points, viewpoint = scanned(self.taught, place[[k]], self.taught_by, rng)
        cloud, X_SB = placed(points, rng, viewpoint)
        return learn(
            Demonstration.make(
                cloud,
                transform(X_SB, place[k]),
                axes=rotate(X_SB.q, normal[k])[None],
                name=f"{self.kind} {self.site}",
            )
        )

    @cached_property
    def scan(self) -> tuple[PointCloud, Pose]:
        """The scan of the new object, and X_SB, the object's frame in the scan's."""
        # All sites and conditions of a seed show the same object in other scans.
        rng = self._rng(2)
        places, _ = self.asked.places(self.site)
        points, viewpoint = scanned(self.asked, places, self.condition, rng)
        return placed(points, rng, viewpoint)

    def errors(self, p_SG: np.ndarray) -> np.ndarray:
        """Return distances (K,) of contacts (K, 3) from the nearest right place [m]."""
        places, _ = self.asked.places(self.site)
        p = transform(invert(self.scan[1]), p_SG)
        return np.linalg.norm(p[:, None] - places, axis=-1).min(axis=1)


def count_of(shape: Shape) -> int:
    """Return the number of points of a full scan."""
    return int(np.clip(shape.area / _PER_POINT, _FEWEST, _MOST))


def scanned(
    shape: Shape, places: np.ndarray, condition: str, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return points (N, 3) under a condition of `CONDITIONS`, and the sensor's place if known."""
    if condition == "camera":
        return _seen_by_camera(shape, places, rng)
    return corrupted(shape, places, condition, rng), None


def corrupted(
    shape: Shape, places: np.ndarray, condition: str, rng: np.random.Generator
) -> np.ndarray:
    """Return points (N, 3) of a shape under a condition of `CONDITIONS`, in the shape's frame."""
    count, size = count_of(shape), shape.size
    if condition == "sparse":
        count = int(max(2_000, shape.area / 0.014**2))
    elif condition == "dense":
        count = min(3 * count, 80_000)
    points = shape.sample(count, rng)
    if condition == "noise":
        points = points + 0.003 * rng.standard_normal(points.shape)
    elif condition == "flying":
        bearing = rng.uniform(-np.pi, np.pi)
        eye = 2.0 * max(size, 0.5) * np.array([np.cos(bearing), np.sin(bearing), 1.0])
        chosen = rng.choice(len(points), len(points) // 100, replace=False)
        ray = points[chosen] - eye
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        points[chosen] += rng.uniform(0.02, 0.3, (len(chosen), 1)) * ray
    elif condition == "misregistered":
        half = points @ rng.standard_normal(3) > 0.0
        turn = quat_about_axis(np.array([0.0, 0.0, 1.0]), np.asarray(np.deg2rad(0.7)))
        points[half] = rotate(turn, points[half]) + 0.003 * rng.standard_normal(3)
    elif condition == "tilt":
        bearing = rng.uniform(-np.pi, np.pi)
        axis = np.array([np.cos(bearing), np.sin(bearing), 0.0])
        points = _tilted(points, axis)
    elif condition == "cut":
        points = _cut(points, places, size, rng)
    return points


def _seen_by_camera(
    shape: Shape, places: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return what a depth camera sees, 2 mm of noise, from a side that shows a place of the site.

    Of eight random sides the first is taken that shows one, else the last.
    """
    middle = 0.5 * (shape.corners.min(axis=0) + shape.corners.max(axis=0))
    for bearing in rng.uniform(-np.pi, np.pi, 8):
        reach = max(1.6 * shape.size, 0.6)
        eye = middle + reach * np.array([np.cos(bearing), np.sin(bearing), 0.9])
        cloud = partial_view(shape.mesh, eye, noise=0.002, rng=rng)
        gap = np.linalg.norm(cloud.points[:, None] - places, axis=-1).min()
        if gap < 0.015:
            break
    return cloud.points, eye


def _tilted(points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return points turned by 3 degrees about an axis through their middle."""
    middle = points.mean(axis=0)
    turn = quat_about_axis(axis, np.asarray(np.deg2rad(3.0)))
    return rotate(turn, points - middle) + middle


def _cut(
    points: np.ndarray, places: np.ndarray, size: float, rng: np.random.Generator
) -> np.ndarray:
    """Return points without those beyond a vertical plane; a place of the site stays visible.

    Of 24 random bearings the first is taken that leaves a place at least 6 % of the size, and at
    least 3 cm, before the plane; else the one that leaves most.
    """
    best, most = points, -np.inf
    for bearing in rng.uniform(-np.pi, np.pi, 24):
        t = np.array([np.cos(bearing), np.sin(bearing)])
        along = points[:, :2] @ t
        limit = np.quantile(along, 1.0 - CUT)
        margin = float(np.max(limit - places[:, :2] @ t))
        if margin > most:
            best, most = points[along < limit], margin
        if margin > max(0.03, 0.06 * size):
            break
    return best
