"""Identify a payload's mass, centre of mass and inertia from the record of a flight.

Newton-Euler is linear in the ten inertial parameters. Its momentum form is multiplied by smooth
window functions and integrated by parts, so that velocities are needed but no accelerations. A
least-squares fit with a prior from the payload's shape gives the parameters and their covariance; a
convex program keeps them physically possible (docs/howto/identify.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drake_aerial.errors import InputError, JobError
from drake_aerial.estimation.inertial_parameters import InertialParameters
from drake_aerial.estimation.momentum_windows import (
    PayloadMotion,
    WindowEquations,
    window_equations,
)
from drake_aerial.estimation.physical_consistency import nearest_possible
from drake_aerial.estimation.shape_prior import ShapePrior
from drake_aerial.geometry import Array, matrix_from_quat, quat_exp
from drake_aerial.io.records import NonNegative, Positive, record

_REWEIGHTINGS = 4
_LEAST_NOISE = 1e-6
"""Smallest standard deviation of an equation, as a fraction of the payload's weight."""
_NEIGHBOURS = 3
"""Windows on either side whose errors may be correlated; windows overlap by half."""
_MIN_WINDOWS = 4
_BIAS = 1e-4
"""Size of the errors whose effect is found by differences [rad] or (dimensionless)."""


@record(frozen=True)
class IdentificationParameters:
    """Windows and prior of an identification."""

    window: Positive = 0.4
    """Length of a window [s]; windows overlap by half."""
    mass_share: Positive = 1.0
    """Standard deviation of the prior's mass, as a fraction of its value (dimensionless)."""
    com_share: Positive = 0.5
    """Standard deviation of the prior's centre of mass, as a fraction of the payload's extent
    (dimensionless)."""
    inertia_share: Positive = 1.0
    """Standard deviation of the prior's inertia, as a fraction of its trace (dimensionless)."""
    attitude_bias: NonNegative = 2e-3
    """Standard deviation of a constant error of the measured attitude about each axis [rad]."""
    force_bias: NonNegative = 2e-3
    """Standard deviation of a constant error of the scale of each cable's force (dimensionless)."""
    observable: Positive = 0.25
    """A direction of the centre of mass counts as unobservable if its standard deviation exceeds
    this fraction of the prior's (dimensionless)."""


@dataclass(frozen=True, eq=False)
class Identification:
    """Identified inertial parameters of a payload, without its grippers.

    Made by `identify_payload`.

    Attributes
    ----------
    parameters : InertialParameters
        In the payload's frame L.
    covariance : (10, 10) array
        Covariance of `parameters.to_vector()`.
    windows : int
        Number of windows.
    residual : (2,) array
        Root mean square of the equations' errors: force [N] and moment [N m].
    constrained : bool
        Whether the least-squares solution was not physically possible and was replaced by the
        nearest possible one.
    unobservable : (k, 3) array
        Unit directions in L along which the centre of mass is not known from the flight.
    """

    parameters: InertialParameters
    covariance: Array
    windows: int
    residual: Array
    constrained: bool
    unobservable: Array

    @property
    def mass_std(self) -> float:
        """Standard deviation of the mass [kg]."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def com_covariance(self) -> Array:
        """Covariance (3, 3) of the centre of mass in L [m^2]."""
        return _com_covariance(self.parameters, self.covariance)

    @property
    def inertia_std(self) -> Array:
        """Standard deviations (3,) of the moments about the centre of mass [kg m^2]."""
        c = self.parameters.com
        J = np.zeros((3, 10))
        for k, (i, j) in enumerate(((1, 2), (0, 2), (0, 1))):
            # I_kk about the centre of mass = I_kk about L - (h_i^2 + h_j^2) / m with h = m c.
            J[k, 0] = c[i] ** 2 + c[j] ** 2
            J[k, 1 + i], J[k, 1 + j] = -2.0 * c[i], -2.0 * c[j]
            J[k, 4 + k] = 1.0
        return np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", J, self.covariance, J), 0.0))

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON values."""
        body = self.parameters
        return {
            "schema": "drake_aerial/identification",
            "version": 1,
            "mass": body.mass,
            "mass_std": self.mass_std,
            "com_L": body.com.tolist(),
            "com_covariance": self.com_covariance.tolist(),
            "inertia": body.inertia.tolist(),
            "inertia_std": self.inertia_std.tolist(),
            "unobservable_L": self.unobservable.tolist(),
            "physically_constrained": self.constrained,
            "windows": self.windows,
            "residual_force_n": float(self.residual[0]),
            "residual_moment_nm": float(self.residual[1]),
        }


def identify_payload(
    motion: PayloadMotion,
    vertices: Array,
    *,
    gripper_mass: Array | float = 0.0,
    parameters: IdentificationParameters | None = None,
) -> Identification:
    """Identify the inertial parameters of a payload from its motion and the forces on it.

    Parameters
    ----------
    motion : PayloadMotion
        T samples of the payload and of the forces at its n contacts.
    vertices : (V, 3) array
        Points of the payload's surface in L [m]. The centre of mass lies in their convex hull.
    gripper_mass : (n,) array or float
        Mass of each gripper at its contact [kg], which is not part of the payload.
    parameters : IdentificationParameters, optional

    Raises
    ------
    InputError
        If the arrays do not fit together.
    JobError
        If the flight is too short, or the payload was never carried.

    Examples
    --------
    >>> from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload
    >>> from drake_aerial import identify_payload, recorded_motion
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> box = SuspendedPayload.from_contacts(box, [[0.1, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    >>> trial = Flight(box, FlightOptions(trajectory=HoverTrajectory(hover_time=1.0))).run()
    >>> result = identify_payload(recorded_motion(trial), trial.vertices, gripper_mass=0.002)
    >>> round(result.parameters.mass, 3)
    0.25

    Notes
    -----
    Source: Newton-Euler in the form of Atkeson, An and Hollerbach (IJRR 1986); physical consistency
    as in Wensing, Kim and Slotine (RA-L 2018).
    """
    p = parameters or IdentificationParameters()
    equations = window_equations(motion, p.window)
    if len(equations.A) < _MIN_WINDOWS:
        raise JobError(
            f"the payload must be carried for at least {_MIN_WINDOWS} windows of {p.window:g} s, "
            f"got {len(equations.A)}: record a longer flight, or shorten `window`"
        )
    carried = equations.mean_pull / float(np.linalg.norm(motion.gravity))
    if not carried > 0.0:
        raise JobError("the cables never pulled the payload upwards; record a flight that lifts it")
    prior = ShapePrior.of_points(vertices, carried, p.mass_share, p.com_share, p.inertia_share)
    A, b = equations.A, equations.b
    scale = _LEAST_NOISE * carried * np.linalg.norm(motion.gravity) * np.array([1.0, prior.extent])
    sigma = np.maximum(scale, 1e-2 * scale / _LEAST_NOISE)
    for _ in range(_REWEIGHTINGS):
        W = np.repeat(sigma**-2.0, 3)
        phi, H = _fit(equations, W, prior)
        residual = b - A @ phi
        per_kind = residual.reshape(len(b), 2, 3)
        sigma = np.maximum(scale, np.sqrt(np.mean(per_kind**2, axis=(0, 2))))
    W = np.repeat(sigma**-2.0, 3)
    phi, H = _fit(equations, W, prior)
    possible = nearest_possible(phi, H, vertices, prior.units)
    covariance = _robust_covariance(A, residual, W, H, prior.information, prior.units)
    for change, size in _possible_biases(motion, p):
        shift = _fit(window_equations(change, p.window), W, prior)[0] - phi
        covariance += (size / _BIAS) ** 2 * np.outer(shift, shift)
    body = InertialParameters.from_vector(possible)
    com_covariance = _com_covariance(body, covariance)
    values, axes = np.linalg.eigh(com_covariance)
    unknown = np.sqrt(np.maximum(values, 0.0)) > p.observable * prior.com_std
    phi_grippers = _point_masses(gripper_mass, motion.p_LC)
    return Identification(
        InertialParameters.from_vector(possible - phi_grippers),
        covariance,
        len(b),
        sigma,
        bool(np.any(possible != phi)),
        axes.T[unknown],
    )


def _fit(equations: WindowEquations, W: Array, prior: ShapePrior) -> tuple[Array, Array]:
    """Return phi (10,) and the information matrix H (10, 10), for weights W (6,)."""
    A, b = equations.A, equations.b
    H = prior.information + np.einsum("kir,i,kis->rs", A, W, A)
    right = prior.information @ prior.mean + np.einsum("kir,i,ki->r", A, W, b)
    # In units of order one, because the information spans many orders of magnitude.
    scaled = H * np.outer(prior.units, prior.units)
    return prior.units * np.linalg.solve(scaled, prior.units * right), H


def _possible_biases(
    motion: PayloadMotion, p: IdentificationParameters
) -> Iterator[tuple[PayloadMotion, float]]:
    """Yield the motion with each constant error of the size `_BIAS`, and the error's likely size.

    The attitude is turned about each axis of L; the force of each cable is scaled.
    """
    for axis in np.eye(3):
        turn = matrix_from_quat(quat_exp(_BIAS * axis))
        W_L = motion.W_L @ turn
        yield replace(motion, R_WL=motion.R_WL @ turn, W_L=W_L), p.attitude_bias
    for i in range(len(motion.p_LC)):
        scale = np.ones((len(motion.p_LC), 1))
        scale[i] += _BIAS
        yield replace(motion, force=scale * motion.force), p.force_bias


def _point_masses(mass: Array | float, p_LC: Array) -> Array:
    """Return phi (10,) of point masses at the contacts (n, 3)."""
    masses = np.broadcast_to(np.asarray(mass, float), len(p_LC))
    if not (masses >= 0.0).all():
        raise InputError(f"`gripper_mass` must be at least 0 kg, got {masses.tolist()}")
    bodies = [InertialParameters(m, p, np.zeros((3, 3))) for m, p in zip(masses, p_LC)]
    return np.sum([body.to_vector() for body in bodies], axis=0)


def _robust_covariance(
    A: Array, residual: Array, W: Array, H: Array, prior: Array, units: Array
) -> Array:
    """Return the covariance (10, 10) for errors that neighbouring windows share.

    Sandwich estimate with Bartlett weights (Newey and West, 1987), plus the prior's share.
    """
    inverse = np.outer(units, units) * np.linalg.inv(H * np.outer(units, units))
    # The error of each window with the fit to the others (Bell and McCaffrey, 2002): the fit
    # follows its own data, more so with few windows.
    own = np.eye(6) - A @ inverse @ np.swapaxes(A, 1, 2) * W
    left_out = np.linalg.solve(own, residual[..., None])[..., 0]
    gradient = np.einsum("kir,i,ki->kr", A, W, left_out)
    meat = gradient.T @ gradient
    for lag in range(1, min(_NEIGHBOURS, len(A) - 1) + 1):
        product = gradient[lag:].T @ gradient[:-lag]
        meat += (1.0 - lag / (_NEIGHBOURS + 1.0)) * (product + product.T)
    covariance = inverse @ (meat + prior) @ inverse
    return 0.5 * (covariance + covariance.T)


def _com_covariance(body: InertialParameters, covariance: Array) -> Array:
    """Return the covariance (3, 3) of the centre of mass, to first order."""
    J = np.column_stack([-body.com, np.eye(3)]) / body.mass
    return J @ covariance[:4, :4] @ J.T
