"""Dryden turbulence: spectra, intensities near the ground, and an exact discretisation."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from annotated_types import Ge
from scipy.special import gammainc

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.records import NonNegative, Number, record

FOOT = 0.3048
"""[m]"""
LOWEST, HIGHEST = 10.0 * FOOT, 1000.0 * FOOT
"""Altitudes between which the low-altitude model is defined [m]."""
ROUGHNESS = 0.15 * FOOT
"""Roughness length of the ground in the terminal phases of flight, MIL-F-8785C 3.7.3.2 [m]."""

_SHAPE = np.array(
    [[0.0, 0.0], [np.sqrt(3.0), 1.0 - np.sqrt(3.0)], [np.sqrt(3.0), 1.0 - np.sqrt(3.0)]]
)

TimeScale = Annotated[Number, Ge(1e-3)]


@record(frozen=True)
class Dryden:
    """Dryden turbulence at one point, with components along the mean wind, across it and up.

    With the time scale T = L / V of a length scale L at the airspeed V, the one-sided spectra over
    the angular frequency w are (MIL-F-8785C)

        along       s^2 2 T / pi / (1 + (T w)^2)
        across, up  s^2 T / pi (1 + 3 (T w)^2) / (1 + (T w)^2)^2

    and the autocorrelations are s^2 exp(-|t| / T) and s^2 (1 - |t| / 2 T) exp(-|t| / T).

    Examples
    --------
    >>> from drake_aerial import Dryden
    >>> gusty = Dryden.low_altitude(altitude=10.0, wind_at_20_feet=8.0)
    >>> [round(s, 1) for s in gusty.intensity]
    [1.5, 1.5, 0.8]
    """

    intensity: tuple[NonNegative, NonNegative, NonNegative]
    """Standard deviations s along the mean wind, across it and up [m/s]."""
    time: tuple[TimeScale, TimeScale, TimeScale]
    """Time scales T along the mean wind, across it and up [s]."""

    @classmethod
    def low_altitude(
        cls, altitude: float, wind_at_20_feet: float, airspeed: float | None = None
    ) -> Dryden:
        """Return the turbulence near the ground, MIL-F-8785C 3.7.3.4.

        In feet, L_w = h, L_u = L_v = h / (0.177 + 0.000823 h)^1.2, s_w = 0.1 W_20 and
        s_u = s_v = s_w / (0.177 + 0.000823 h)^0.4.

        Parameters
        ----------
        altitude : float
            h, height over the ground, from 10 to 1000 ft [m].
        wind_at_20_feet : float
            W_20, mean wind speed 20 ft (6.1 m) over the ground [m/s].
        airspeed : float, optional
            V, speed of the vehicle in the air [m/s]. By default the mean wind at the altitude
            (`mean_wind`), for a vehicle that hovers.

        Raises
        ------
        InputError
            If the altitude is outside of the model or a speed is not positive.
        """
        if not LOWEST - 1e-9 <= altitude <= HIGHEST + 1e-9:
            raise InputError(
                f"`altitude` must be in [{LOWEST:.3g}, {HIGHEST:.4g}] m, got {altitude!r}"
            )
        if not (np.isfinite(wind_at_20_feet) and wind_at_20_feet > 0.0):
            raise InputError(f"`wind_at_20_feet` must be positive [m/s], got {wind_at_20_feet!r}")
        speed = mean_wind(altitude, wind_at_20_feet) if airspeed is None else airspeed
        if not (np.isfinite(speed) and speed > 0.0):
            raise InputError(f"`airspeed` must be positive [m/s], got {airspeed!r}")
        height = altitude / FOOT
        slope = 0.177 + 0.000823 * height
        length, up = altitude / slope**1.2, 0.1 * wind_at_20_feet
        level = up / slope**0.4
        return cls((level, level, up), (length / speed, length / speed, altitude / speed))

    def steps(self, period: float) -> tuple[Array, Array, Array, Array]:
        """Return the exact discretisation x_next = Phi x + N z, wind = C x, z standard normal.

        The state x (2) of a component is white noise filtered by 1 / (1 + T s), and that filtered
        by 1 / (1 + T s) once more.

        Parameters
        ----------
        period : float
            Time step [s].

        Returns
        -------
        Phi, N : (3, 2, 2) arrays
        C : (3, 2) array
            [m/s]
        N0 : (2, 2) array
            N0 z has the stationary distribution of x.
        """
        a = period / np.asarray(self.time)
        decay, zero = np.exp(-a), np.zeros(3)
        Phi = np.stack([np.stack([decay, zero], -1), np.stack([a * decay, decay], -1)], -2)
        # Integrals of exp(-2 x) (1, x, x^2) from 0 to a; the incomplete gamma function is exact for
        # short periods.
        q0, q1, q2 = gammainc(1, 2 * a) / 2, gammainc(2, 2 * a) / 4, gammainc(3, 2 * a) / 4
        first = np.sqrt(q0)
        N = np.stack(
            [np.stack([first, zero], -1), np.stack([q1 / first, np.sqrt(q2 - q1 * q1 / q0)], -1)],
            -2,
        )
        C = np.asarray(self.intensity)[:, None] * (
            _SHAPE + [[np.sqrt(2.0), 0.0], [0.0, 0.0], [0.0, 0.0]]
        )
        return Phi, N, C, np.linalg.cholesky(np.array([[0.5, 0.25], [0.25, 0.25]]))


def mean_wind(altitude: float, wind_at_20_feet: float) -> float:
    """Return the mean wind speed [m/s] at an altitude [m]: log profile, MIL-F-8785C 3.7.3.2."""
    return float(wind_at_20_feet * np.log(altitude / ROUGHNESS) / np.log(20.0 * FOOT / ROUGHNESS))
