"""Recognise one camera's view that is still in the camera's axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.cloud.view_evidence import ViewEvidence, view_evidence
from drake_aerial.geometry import Array

_MIN_POINTS = 200
# Tangent of the largest angle between a pixel's ray and the optical axis, as of wide depth cameras.
_MAX_TANGENT = 1.8
# On a lattice, the gaps within columns of pixels sum up to less than this fraction of the width,
# and there are several points for each column.
_MAX_SPREAD, _MIN_SHARED = 0.05, 4
# Amplitude of the strongest period in x/z and y/z of pixels, and its ratio to that in x and y.
_MIN_AMPLITUDE, _AMPLITUDE_RATIO = 0.2, 2.0
_BINS, _FEWEST_PERIODS = 2**14, 20
# A scan from several sides has at least this fraction of points on rays with two layers.
_LAYERED = 0.25
# A tilted plane has this fraction of the points and this angle to the horizontal [deg]; there are
# fewer points than this fraction on level planes.
_PLANE, _TILT, _LEVEL = 0.25, (6.0, 84.0), 0.1
# Agreement of the hull with a view from the origin: of convex objects, and of plates.
_CONVEX, _PLATE = 0.75, 0.4
_MIN_RIMS, _RIM_FRACTION = 20, 0.5
# Points on the other side of a roof, as a fraction of those on the first.
_ROOF = 0.15


@dataclass(frozen=True)
class SensorAxes:
    """A cloud that is, or could be, one camera's view in the camera's axes.

    Attributes
    ----------
    axes : str
        "z forward", or "z backward" with y up, as librealsense exports it.
    certain : bool
        True if the evidence is against z as the up direction; False if it is undecided.
    reason : str
        The evidence, as part of a sentence about the points.
    """

    axes: str
    certain: bool
    reason: str


def camera_axes(points: Array, *, seen_from_origin: bool = False) -> SensorAxes | None:
    """Return the axes of points (N, 3) that may be a camera's view from the origin, else None.

    All points of such a view are in front of the origin. `seen_from_origin` says that the sensor
    is known to be there. The evidence on the axes, in this order:

    1. x/z and y/z take few equidistant values, those of columns and rows of pixels. It holds with
       noise of the range and in crops.
    2. x/z and y/z are periodic. It holds also if coordinates are rounded, or averaged in voxels
       that are not much wider than a pixel.
    3. Rays from the origin meet two layers of points: the scan is from several sides.
    4. Points are where the convex hull faces the origin, and nowhere else; or one layer begins
       where another ends, as seen from the origin; and the planes are not level. It holds for
       averaged clouds.
    """
    if not (points[:, 2].min() > 0.0 or points[:, 2].max() < 0.0):
        return None
    x, y, z = points.T
    u, v = x / z, y / z
    if max(np.abs(u).max(), np.abs(v).max()) > _MAX_TANGENT:
        return None
    axes = "z forward" if z[0] > 0.0 else "z backward"
    if seen_from_origin and z[0] > 0.0:
        return SensorAxes(axes, True, "all are above the sensor, if z is up")
    if len(points) < _MIN_POINTS:
        return SensorAxes(axes, False, "all are in front of the origin")
    lattice = _is_lattice(u) and _is_lattice(v) and not (_is_lattice(x) and _is_lattice(y))
    depths = np.percentile(np.abs(z), [5.0, 95.0])
    if lattice or (_is_periodic(u, x, depths) and _is_periodic(v, y, depths)):
        return SensorAxes(axes, True, "they lie on the rays of a camera's pixels")
    evidence = view_evidence(points)
    if evidence.layered > _LAYERED:
        return None
    reason = _against_z_up(evidence, forward=z[0] > 0.0)
    if reason is None:
        return SensorAxes(axes, False, "all are in front of the origin, in one layer")
    return SensorAxes(axes, True, reason)


def _against_z_up(evidence: ViewEvidence, *, forward: bool) -> str | None:
    """Return why z is not up, or None if that is undecided."""
    low, high = _TILT
    tilted = (
        evidence.plane >= _PLANE and low < evidence.plane_tilt < high and evidence.level < _LEVEL
    )
    rims = evidence.rims >= _MIN_RIMS and evidence.rim_fraction > _RIM_FRACTION
    if tilted and rims:
        return "the origin sees where each is hidden by others, and their planes are tilted"
    # With z backward and up, the sensor is above the object, and the planes may be a roof's.
    roof = not forward and evidence.roof > _ROOF * evidence.plane
    if tilted and not roof and evidence.agreement > _PLATE:
        return "only sides that face the origin are there, and their planes are tilted"
    # With z forward and up, the sensor would be below the object.
    if forward and evidence.agreement > _CONVEX and evidence.level < _LEVEL:
        return "only sides that face the origin are there"
    return None


def lattice_step(values: Array) -> float | None:
    """Return the spacing if values (N,) lie near a few equally spaced numbers, else None."""
    gaps = np.sort(np.diff(np.sort(values)))
    width = gaps.sum()
    if not width > 0.0:
        return None
    # Half of the width is made of gaps that are at least as wide as a step.
    step = float(gaps[np.searchsorted(np.cumsum(gaps), 0.5 * width)])
    small = gaps < 0.25 * step
    columns = len(gaps) - int(np.count_nonzero(small)) + 1
    spread = float(gaps[small].sum()) / width
    return step if spread < _MAX_SPREAD and columns * _MIN_SHARED <= len(values) else None


def _is_lattice(values: Array) -> bool:
    """Return whether values (N,) are close to a few equidistant ones."""
    return lattice_step(values) is not None


def _is_periodic(ratio: Array, coordinate: Array, depths: Array) -> bool:
    """Return whether ratios (N,) of a coordinate to z are periodic, but not the coordinate.

    A coordinate on a grid, at depths (2,) from the nearest to the farthest, also gives periodic
    ratios.
    """
    spectrum, width = _spectrum(ratio)
    # Fewer periods are the shape's; more than a quarter of the bins cannot be told apart.
    usable = spectrum[_FEWEST_PERIODS : len(spectrum) // 2]
    if usable.max(initial=0.0) < _MIN_AMPLITUDE:
        return False
    frequency = (_FEWEST_PERIODS + int(np.argmax(usable))) / width
    other, other_width = _spectrum(coordinate)
    first, last = (int(frequency / depth * other_width) for depth in depths[::-1])
    rival = other[max(first - 1, _FEWEST_PERIODS) : last + 2]
    return bool(usable.max() > _AMPLITUDE_RATIO * rival.max(initial=0.0))


def _spectrum(values: Array) -> tuple[Array, float]:
    """Return the amplitude by number of periods over the values' width, and that width."""
    low, high = np.percentile(values, [1.0, 99.0])
    # Values that differ by rounding alone have no room for the bins.
    if not high - low > 4.0 * _BINS * np.spacing(max(abs(low), abs(high))):
        return np.zeros(1), 1.0
    inside = values[(values >= low) & (values <= high)]
    histogram = np.histogram(inside, bins=_BINS, range=(low, high))[0]
    return np.abs(np.fft.rfft(histogram)) / len(inside), float(high - low)
