"""A kernel density of votes on a grid, interpolated by cubic splines, with gradients."""

from collections.abc import Sequence

import numpy as np

from drake_aerial.geometry import Array

# Floor of the density, relative to its largest value: far from every vote its log stays finite.
FLOOR = 1e-8
# Grid cells per bandwidth.
CELLS_PER_SIGMA = 4
# Margin of the grid around the region of interest, in bandwidths.
MARGIN = 4.0


class GridDensity:
    """Kernel density of weighted votes over D coordinates, of which some may be angles.

    Parameters
    ----------
    votes : (M, D) array
        Votes, angles in rad. Votes beyond the grid's margin are dropped.
    weights : (M,) array
        Weights, not negative.
    sigma : (D,) sequence
        Bandwidths.
    lower, upper : (D,) sequences
        Region of interest; 0 to 2 pi for angles.
    periodic : (D,) sequence of bool
        Whether each coordinate is an angle.
    best_of_last : bool
        Whether a soft maximum over the last coordinate is taken, which leaves a function of the
        others. Votes then add up only where they agree in the last coordinate.

    Attributes
    ----------
    total : float
        Weight of the votes that fell on the grid.
    """

    def __init__(
        self,
        votes: Array,
        weights: Array,
        sigma: Sequence[float],
        lower: Sequence[float],
        upper: Sequence[float],
        periodic: Sequence[bool],
        best_of_last: bool = False,
    ):
        from scipy.ndimage import gaussian_filter1d, spline_filter1d

        sigma_ = np.asarray(sigma, float)
        self._periodic = tuple(periodic)
        wrap = np.asarray(periodic)
        reach = np.where(wrap, 0.0, MARGIN * sigma_)
        self._lower = np.asarray(lower, float) - reach
        span = np.asarray(upper, float) + reach - self._lower
        self._shape = np.ceil(span / (sigma_ / CELLS_PER_SIGMA)).astype(int) + np.where(wrap, 0, 1)
        self._step = span / (self._shape - np.where(wrap, 0, 1))
        grid = self._deposited(votes, weights)
        self.total = float(grid.sum())
        for axis, periodic_ in enumerate(self._periodic):
            cells = sigma_[axis] / self._step[axis]
            grid = gaussian_filter1d(
                grid, cells, axis=axis, mode="wrap" if periodic_ else "constant", truncate=5
            )
        if best_of_last:
            grid = _soft_maximum(grid)
            self._shape, self._step, self._lower = (
                self._shape[:-1],
                self._step[:-1],
                self._lower[:-1],
            )
            self._periodic = self._periodic[:-1]
        self._log_scale = 0.0
        if self.total > 0.0:
            top = grid.max()
            self._log_scale = float(np.log(top) - np.log(self.total) - np.log(self._step).sum())
            grid = np.log(grid / top + FLOOR)
        self._values = grid
        for axis, periodic_ in enumerate(self._periodic):
            grid = spline_filter1d(grid, axis=axis, mode="grid-wrap" if periodic_ else "mirror")
        self._coefficients = grid

    def _deposited(self, votes: Array, weights: Array) -> Array:
        """Return the grid of vote weights, each shared among the corners of its cell."""
        position = (votes - self._lower) / self._step
        grid = np.zeros(int(np.prod(self._shape)))
        base = np.floor(position).astype(int)
        fraction = position - base
        for corner in np.ndindex(*(2,) * len(self._shape)):
            cell = base + corner
            share = np.prod(np.where(corner, fraction, 1.0 - fraction), axis=1) * weights
            cell = np.where(self._periodic, cell % self._shape, cell)
            inside = np.all((cell >= 0) & (cell < self._shape), axis=1)
            flat = np.ravel_multi_index(tuple(cell[inside].T), tuple(self._shape))
            grid += np.bincount(flat, share[inside], minlength=len(grid))
        return grid.reshape(self._shape)

    @property
    def mode(self) -> Array:
        """The grid point (D,) of the largest density."""
        index = np.array(np.unravel_index(np.argmax(self._values), self._values.shape))
        return self._lower + index * self._step

    def log_density(self, x: Array) -> Array:
        """Return the log-density (...) at x (..., D), normalised over the grid; flat outside it."""
        return self._evaluate(x, gradient=False)[0]

    def log_density_and_gradient(self, x: Array) -> tuple[Array, Array]:
        """Return the log-density (...) and its gradient (..., D) at x (..., D)."""
        return self._evaluate(x, gradient=True)

    def _evaluate(self, x: Array, gradient: bool) -> tuple[Array, Array]:
        x = np.asarray(x, float)
        dimension = len(self._shape)
        position = (x.reshape(-1, dimension) - self._lower) / self._step
        last, wrap = self._shape - 1, np.array(self._periodic)
        u = np.where(wrap, position, np.clip(position, 0.0, last))
        base = np.floor(u)
        t = u - base
        # Four grid points around x per axis, mirrored about the ends of the axis.
        taps = base.astype(int)[..., None] + np.arange(-1, 3)
        ends = last[:, None]
        taps = np.where(
            wrap[:, None], taps % self._shape[:, None], ends - np.abs(ends - np.abs(taps))
        )
        weights = _spline(t)
        flat = np.zeros((len(position),) + (1,) * dimension, dtype=int)
        for axis in range(dimension):
            flat = flat * self._shape[axis] + _along(taps[:, axis], axis, dimension)
        picked = self._coefficients.ravel().take(flat)
        value = _contracted(picked, weights) + self._log_scale
        slope_out = np.zeros((len(position), dimension))
        if gradient:
            inside = wrap | ((position >= 0) & (position <= last))
            slopes = _spline_slope(t) / self._step[:, None] * inside[..., None]
            for axis in range(dimension):
                factors = weights.copy()
                factors[:, axis] = slopes[:, axis]
                slope_out[:, axis] = _contracted(picked, factors)
        return value.reshape(x.shape[:-1]), slope_out.reshape(x.shape)


def _along(values: np.ndarray, axis: int, dimension: int) -> np.ndarray:
    """Return values (N, 4) with their second axis as axis 1 + `axis` of 1 + `dimension` axes."""
    return values.reshape(len(values), *(4 if k == axis else 1 for k in range(dimension)))


def _contracted(picked: Array, weights: Array) -> Array:
    """Return the sums (N,) of coefficients (N, 4, ..., 4) by the weights (N, D, 4) of D axes."""
    for axis in range(weights.shape[1] - 1, -1, -1):
        w = weights[:, axis].reshape(len(weights), *(1,) * (axis - 1), 4) if axis else weights[:, 0]
        picked = np.vecdot(picked, w) if axis == 0 else np.matvec(picked, w)
    return picked


def _soft_maximum(grid: Array) -> Array:
    """Return a soft maximum over the last axis: the fourth root of the mean fourth power."""
    top = max(float(grid.max()), 1e-300)
    return top * np.mean((grid / top) ** 4, axis=-1) ** 0.25


def _spline(t: Array) -> Array:
    """Return the cubic B-spline's four weights (..., 4) at fractions t (...)."""
    s = 1.0 - t
    out = np.empty((*t.shape, 4))
    t2, s2 = t * t, s * s
    out[..., 0] = s2 * s
    out[..., 1] = t2 * (3.0 * t - 6.0) + 4.0
    out[..., 2] = s2 * (3.0 * s - 6.0) + 4.0
    out[..., 3] = t2 * t
    out /= 6.0
    return out


def _spline_slope(t: Array) -> Array:
    """Return the derivatives (..., 4) of `_spline` by t."""
    s = 1.0 - t
    return np.stack(
        [-(s**2) / 2, (3 * t**2 - 4 * t) / 2, -(3 * s**2 - 4 * s) / 2, t**2 / 2], axis=-1
    )
