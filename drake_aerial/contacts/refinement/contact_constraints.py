"""Feasibility of grippers as smooth constraints with Jacobians.

A constraint has lower and upper bounds (m,). It maps the grippers X_NG (n,) of one configuration to
values (m,) and their Jacobians by positions p (m, n, 3) [1/m] and by rotation vectors w (m, n, 3)
of the perturbed rotations exp(w) R_NG. The bounds are slightly tighter than those of
`reasons_against`, whose checks are not smooth.
"""

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from drake_aerial.contacts.feasibility.checks import FOOT
from drake_aerial.contacts.feasibility.contact_checker import ContactChecker
from drake_aerial.contacts.likelihood.formation_frame import (
    FormationFrame,
    FormationFrames,
    about_z,
)
from drake_aerial.contacts.refinement.smooth_surface import SmoothSurface
from drake_aerial.geometry import Array, Pose, axis_of, cross, perpendicular

# Width of the soft minimum over obstacles [m].
_SOFT = 0.001
# Least cosine between cable and gripper axis: they enclose less than 89 degrees.
_OUTWARD = 0.0175
# Margin of the gap to the scan below its bound [m].
_GAP_MARGIN = 5e-4


class Constraint(Protocol):
    """Bounds and a differentiable function of grippers."""

    lower: Array
    upper: Array

    def __call__(self, X_NG: Pose) -> tuple[Array, Array, Array]:
        """Return the values (m,) and their Jacobians by p and by w, (m, n, 3) each."""
        ...


class SurfaceConstraint:
    """One gripper on the surface: flush, not over a hole or beyond an edge, not upside down.

    Values: the level above the surface [m]; two components of the deviation of the axis from the
    normal (sines); the gap to the scan's points [m]; the sine of the axis' elevation.

    Parameters
    ----------
    surface : SmoothSurface
        The surface near the gripper.
    axis : (3,) array
        Axis of the gripper at the start; the deviation's components are across it.
    largest_gap : float
        Upper bound of the gap [m].
    min_elevation : float
        Lower bound of the elevation [rad].
    """

    def __init__(
        self, surface: SmoothSurface, axis: Array, largest_gap: float, min_elevation: float
    ):
        self._surface = surface
        e1 = perpendicular(axis)
        self._across = np.stack([e1, cross(axis, e1)])
        self.lower = np.array([0.0, 0.0, 0.0, 0.0, np.sin(min_elevation) + 1e-3])
        self.upper = np.array([0.0, 0.0, 0.0, largest_gap, np.inf])

    def __call__(self, X_NG: Pose) -> tuple[Array, Array, Array]:
        """Return values (5,) and Jacobians (5, 1, 3) for one gripper X_NG (1,)."""
        z = axis_of(X_NG.q[0], 2)
        foot = self._surface.footing(X_NG.p[0], z)
        value = np.array([foot.level, 0.0, 0.0, foot.gap, z[2]])
        by_p, by_z = np.zeros((5, 3)), np.zeros((5, 3))
        value[1:3] = self._across @ cross(z, foot.normal)
        by_p[0], by_z[0] = foot.level_by_p, foot.level_by_z
        # a.(z x n): its gradients by z and n are n x a and a x z.
        by_normal = cross(self._across, z)
        by_p[1:3] = by_normal @ foot.normal_by_p
        by_z[1:3] = cross(foot.normal, self._across) + by_normal @ foot.normal_by_z
        by_p[3] = foot.gap_by_p
        by_z[4, 2] = 1.0
        return value, by_p[:, None], cross(z, by_z)[:, None]


class CableConstraint:
    """One cable clear of the payload: it leaves the gripper outwards, and no scan point is near it.

    Values: the cosine between the cable and the gripper's axis; the soft minimum of the distances
    [m] of scan points from the cable, without its foot next to the gripper.

    Parameters
    ----------
    frames : FormationFrames
        Formation frames, which give the cables' directions.
    gripper : int
        Index of the gripper.
    X_NG : Pose
        Grippers of the seed, batch (n,).
    points : (N, 3) array
        Points of the scan [m].
    clearance : float
        Lower bound of the distance [m].
    reach : float
        Largest displacement of a contact from the seed [m].
    """

    def __init__(
        self,
        frames: FormationFrames,
        gripper: int,
        X_NG: Pose,
        points: Array,
        clearance: float,
        reach: float,
    ):
        configuration = frames.configuration
        self._frames, self._gripper = frames, gripper
        self._direction_F = configuration.cable_direction[gripper]
        self._span = max(float(configuration.cable_length[gripper]) - FOOT, 0.0)
        self._points = points
        distance = self._distances(X_NG)[0]
        near = distance <= clearance + 2.0 * reach
        near[np.argmin(distance)] = True
        self._points = points[near]
        self.lower, self.upper = np.array([_OUTWARD, clearance + 1e-3]), np.array([np.inf, np.inf])

    def __call__(self, X_NG: Pose) -> tuple[Array, Array, Array]:
        """Return values (2,) and Jacobians (2, n, 3)."""
        k = self._gripper
        distance, apart, along, d, frame = self._distances(X_NG)
        z, turn = axis_of(X_NG.q[k], 2), about_z(d)
        nearest = distance.min()
        share = np.exp(-(distance - nearest) / _SOFT)
        value = np.array([d @ z, nearest - _SOFT * np.log(share.sum())])
        share /= share.sum()
        away = apart / np.maximum(distance, 1e-9)[:, None]
        by_yaw = np.array([turn @ z, -(share * (FOOT + along)) @ (away @ turn)])
        by_p = by_yaw[:, None, None] * frame.yaw_by_p
        by_w = by_yaw[:, None, None] * frame.yaw_by_w
        by_w[0, k] += cross(z, d)
        by_p[1, k] -= share @ away
        return value, by_p, by_w

    def _distances(self, X_NG: Pose) -> tuple[Array, Array, Array, Array, FormationFrame]:
        """Return where scan points are relative to the cable.

        Returns
        -------
        distance : (N,) array
            Distances from the cable [m].
        apart : (N, 3) array
            Offsets from the cable's nearest point [m].
        along : (N,) array
            Distance of that point from the end of the foot, along the cable [m].
        d : (3,) array
            Direction of the cable.
        frame : FormationFrame
            The formation frame.
        """
        frame = self._frames(X_NG)
        d = frame.turned(self._direction_F)
        offset = self._points - (X_NG.p[self._gripper] + FOOT * d)
        along = np.clip(offset @ d, 0.0, self._span)
        apart = offset - along[:, None] * d
        return np.sqrt(np.sum(apart * apart, axis=1)), apart, along, d, frame


class SeparationConstraint:
    """Separation of quadrotors: squared distance of every pair over the squared least distance.

    Parameters
    ----------
    frames : FormationFrames
        Formation frames, which give the cables' directions, n > 1.
    separation : float
        Least distance [m].
    """

    def __init__(self, frames: FormationFrames, separation: float):
        configuration = frames.configuration
        self._frames, self._separation = frames, separation
        self._first, self._second = np.triu_indices(len(configuration), 1)
        self._cable = configuration.cable_direction * configuration.cable_length[:, None]
        self.lower = np.full(len(self._first), 1.001)
        self.upper = np.full(len(self._first), np.inf)

    def __call__(self, X_NG: Pose) -> tuple[Array, Array, Array]:
        """Return values (n (n-1) / 2,) and Jacobians by p and w."""
        frame = self._frames(X_NG)
        cable = frame.turned(self._cable)
        p_NQ = X_NG.p + cable
        apart = (p_NQ[self._first] - p_NQ[self._second]) / self._separation
        turn = about_z(cable)
        by_yaw = (
            2.0
            / self._separation
            * np.sum(apart * (turn[self._first] - turn[self._second]), axis=1)
        )
        by_p = by_yaw[:, None, None] * frame.yaw_by_p
        by_w = by_yaw[:, None, None] * frame.yaw_by_w
        pair = np.arange(len(apart))
        by_p[pair, self._first] += 2.0 / self._separation * apart
        by_p[pair, self._second] -= 2.0 / self._separation * apart
        return np.sum(apart * apart, axis=1), by_p, by_w


def contact_constraints(
    checker: ContactChecker, frames: FormationFrames, seed: Pose, start: Pose, reach: float
) -> Iterator[tuple[str, Constraint, slice]]:
    """Yield the name of each constraint, the constraint, and the grippers that it depends on.

    Parameters
    ----------
    checker : ContactChecker
        Surface and limits.
    frames : FormationFrames
        Formation frames of the likelihood's configuration model.
    seed, start : Pose
        Grippers X_NG (n,) of the seed and of the initial guess.
    reach : float
        Largest displacement of a contact from the seed along each axis [m].
    """
    limits, surface, features = checker.parameters, checker.surface, checker.features
    largest_gap = max(limits.off_surface, surface.hole) - _GAP_MARGIN
    clearance = max(limits.clearance, surface.spacing)
    every = slice(None)
    for k in range(len(seed.p)):
        near = SmoothSurface(features, seed.p[k], np.sqrt(3.0) * reach, surface.spacing)
        axis = axis_of(start.q[k], 2)
        on = SurfaceConstraint(near, axis, largest_gap, limits.min_elevation)
        yield f"gripper {k + 1} on the surface", on, slice(k, k + 1)
        cable = CableConstraint(frames, k, seed, features.p, clearance, reach)
        yield f"cable {k + 1} clear of the payload", cable, every
    if len(seed.p) > 1:
        yield "quadrotors apart", SeparationConstraint(frames, limits.separation), every
