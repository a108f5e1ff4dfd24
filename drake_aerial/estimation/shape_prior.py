"""Prior of a payload's inertial parameters, from its shape alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.estimation.inertial_parameters import InertialParameters
from drake_aerial.geometry import IDENTITY, Array


@dataclass(frozen=True, eq=False)
class ShapePrior:
    """Gaussian prior of the ten parameters: a uniform box around the payload, with wide limits.

    Attributes
    ----------
    mean : (10,) array
    information : (10, 10) array
        Inverse of the covariance.
    extent : float
        Largest extent of the payload [m].
    com_std : float
        Standard deviation of the centre of mass along each axis [m].
    """

    mean: Array
    information: Array
    extent: float
    com_std: float

    @property
    def units(self) -> Array:
        """Sizes (10,) by which the parameters are divided to be of order one."""
        m, d = self.mean[0], self.extent
        return np.array([m, *[m * d] * 3, *[m * d * d] * 6])

    @classmethod
    def of_points(
        cls, points: Array, mass: float, mass_share: float, com_share: float, inertia_share: float
    ) -> ShapePrior:
        """Return the prior of a payload with a surface through `points` (V, 3) in L [m].

        Parameters
        ----------
        points : (V, 3) array
        mass : float
            First guess of the mass [kg], such as what the cables carry.
        mass_share, com_share, inertia_share : float
            Standard deviations over mass, largest extent, and trace of the inertia.
        """
        low, high = points.min(axis=0), points.max(axis=0)
        size = high - low
        extent = float(size.max())
        J = mass / 12.0 * (size @ size * IDENTITY - np.diag(size * size))
        body = InertialParameters(mass, 0.5 * (low + high), J)
        mean = body.to_vector()
        com_std = com_share * extent
        # The first moment m c and the inertia about L follow the mass at a fixed shape.
        by_mass = mean / mass
        spread = np.zeros(10)
        spread[1:4] = mass * com_std
        spread[4:10] = inertia_share * np.trace(J) + mass * com_std**2
        covariance = np.diag(spread**2) + (mass_share * mass) ** 2 * np.outer(by_mass, by_mass)
        information = np.asarray(np.linalg.inv(covariance), np.float64)
        return cls(mean, information, extent, com_std)
