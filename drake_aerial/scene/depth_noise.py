"""The noise of a structured-light depth camera, for rendered depth images.

The defaults are fitted to 45 images of Kinect and Xtion cameras (docs/howto/scene.md).
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from annotated_types import Le, Lt
from numpy.typing import ArrayLike, NDArray

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.records import NonNegative, Positive, record


@record(frozen=True)
class DepthNoise:
    """Noise of a structured-light depth camera.

    The camera measures disparity, which is proportional to inverse depth. A constant noise there is
    a noise of depth that grows with the square of depth. Widths are in pixels of a 640 x 480 image.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial.scene.depth_noise import DepthNoise
    >>> wall = np.full((48, 64), 1.5)
    >>> image = DepthNoise().applied(wall, np.random.default_rng(0))
    >>> bool(0.002 < image.std() < 0.008)
    True
    """

    inverse_depth: NonNegative = 2.0e-3
    """Standard deviation of the inverse depth before quantisation [1/m]."""
    correlation_u: NonNegative = 2.2
    """Standard deviation of the Gaussian that smooths the noise along rows [pixels]."""
    correlation_v: NonNegative = 1.4
    """Standard deviation of the Gaussian that smooths the noise along columns [pixels]."""
    quantum: NonNegative = 2.85e-3
    """Step of the inverse depth [1/m]; 0 for no quantisation."""
    jump: Positive = 0.02
    """Relative difference in depth of neighbouring pixels that makes a depth jump
    (dimensionless)."""
    flying: Annotated[NonNegative, Le(1)] = 0.25
    """Probability that a pixel beside a jump has a depth between the two (dimensionless)."""
    shadow_u: NonNegative = 4.0
    """Mean width of the strip without depth on the far side of a jump along a row [pixels]."""
    shadow_v: NonNegative = 2.0
    """Mean width of the strip without depth on the far side of a jump along a column [pixels]."""
    grazing: Annotated[Positive, Lt(90)] = 80.0
    """Angle between ray and normal from which on a surface gives no depth [deg]."""
    nearest: NonNegative = 0.4
    """Smallest depth [m]."""
    farthest: Positive = 8.0
    """Largest depth [m]."""

    def applied(
        self, depth: ArrayLike, rng: np.random.Generator, focal_length: float = 525.0
    ) -> Array:
        """Return a depth image (H, W) [m] with noise; 0 where the camera gives no depth.

        Parameters
        ----------
        depth : (H, W) array
            True depths along z [m]; values that are not positive or not finite have no depth.
        rng : numpy.random.Generator
        focal_length : float
            Focal length [pixels], for the angle between ray and surface.

        Raises
        ------
        InputError
            If the image does not have two dimensions.
        """
        from scipy.ndimage import gaussian_filter

        true = np.array(depth, dtype=np.float64)
        if true.ndim != 2:
            raise InputError(f"`depth` must have the shape (H, W), got {true.shape}")
        valid = np.isfinite(true) & (true >= self.nearest) & (true <= self.farthest)
        inverse = np.where(valid, 1.0 / np.where(valid, true, 1.0), 0.0)
        far_u, flying_u = self._jumps(inverse, rng, self.shadow_u)
        far_v, flying_v = self._jumps(inverse.T, rng, self.shadow_v)
        lost = far_u | far_v.T | self._grazing(inverse, focal_length)
        white = rng.standard_normal(true.shape)
        smooth = gaussian_filter(white, (self.correlation_v, self.correlation_u))
        noisy = np.where(flying_v.T > 0.0, flying_v.T, inverse)
        noisy = np.where(flying_u > 0.0, flying_u, noisy)
        if smooth.std() > 0.0:
            noisy = noisy + self.inverse_depth * smooth / smooth.std()
        if self.quantum > 0.0:
            noisy = self.quantum * np.round(noisy / self.quantum)
        given = valid & ~lost & (noisy > 0.0)
        return np.where(given, 1.0 / np.where(given, noisy, 1.0), 0.0)

    def _jumps(
        self, inverse: Array, rng: np.random.Generator, width: float
    ) -> tuple[NDArray[np.bool_], Array]:
        """Return which pixels lie in a shadow of a jump along rows, and inverse depths in between.

        The inverse depths are 0 for pixels that do not fly.
        """
        columns = inverse.shape[1]
        near, far = np.maximum(inverse[:, :-1], inverse[:, 1:]), inverse[:, :-1]
        far = np.minimum(far, inverse[:, 1:])
        jump = (far > 0.0) & (near > (1.0 + self.jump) * far)
        row, column = np.nonzero(jump)
        to_right = inverse[row, column] > inverse[row, column + 1]
        step = np.where(to_right, 1, -1)
        first = column + to_right
        shadow = np.zeros(inverse.shape, bool)
        length = np.floor(rng.exponential(width, len(row))).astype(int) if width else 0 * row
        for k in range(int(length.max(initial=0))):
            hit = (length > k) & (first + k * step >= 0) & (first + k * step < columns)
            shadow[row[hit], (first + k * step)[hit]] = True
        flying = np.zeros(inverse.shape)
        flies = rng.random(len(row)) < self.flying
        share = rng.random(len(row))
        between = share * near[row, column] + (1.0 - share) * far[row, column]
        flying[row[flies], first[flies]] = between[flies]
        shadow[row[flies], first[flies]] = False
        return shadow, flying

    def _grazing(self, inverse: Array, focal_length: float) -> NDArray[np.bool_]:
        """Return which pixels show a surface at a grazing angle.

        On a plane, inverse depth is linear in the pixel. The gradient times f z is the tangent of
        the angle between the optical axis and the normal.
        """
        safe = np.where(inverse > 0.0, inverse, 1.0)
        gradient = []
        for axis in (0, 1):
            before = np.diff(inverse, axis=axis, prepend=np.take(inverse, [0], axis))
            after = np.diff(inverse, axis=axis, append=np.take(inverse, [-1], axis))
            # The smaller of the two differences ignores a jump on one side.
            gradient.append(np.where(np.abs(before) < np.abs(after), before, after))
        tangent = np.hypot(*gradient) * focal_length / safe
        return (inverse > 0.0) & (tangent > np.tan(np.deg2rad(self.grazing)))
