"""Mass properties that a controller believes in: `below_contact`, `geometric` or `true`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.choices import BELIEFS
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.air import AirParameters, PayloadAir, payload_air
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.gripper import GripperParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.simulation.station_parameters import each

_MIN_SIZE = 0.02
"""Smallest believed extent of a payload [m]; the scan of one face has none across it."""


def suspended_properties(
    payload: Payload, p_LC: Array, gripper: GripperParameters | Sequence[GripperParameters]
) -> tuple[float, Array, Array]:
    """Return mass, centre of mass and inertia of a payload with n grippers.

    Parameters
    ----------
    payload : Payload
        In L.
    p_LC : (n, 3) array
        Contacts in L [m]; a gripper is a point mass at its contact.
    gripper : GripperParameters, or a sequence of n

    Returns
    -------
    Mass [kg], centre of mass (3,) in L [m], inertia (3, 3) about it in L's axes [kg m^2].
    """
    masses = np.array([payload.mass] + [g.mass for g in each(gripper, len(p_LC), "grippers")])
    points = np.concatenate([payload.com[None], p_LC])
    total = float(masses.sum())
    com = masses @ points / total
    arms = points - com
    squares = np.einsum("i,ij,ij->", masses, arms, arms)
    inertia = payload.inertia + squares * np.eye(3) - np.einsum("i,ij,ik->jk", masses, arms, arms)
    return total, com, inertia


def believed_model(
    belief: str,
    payload: Payload,
    p_LC: ArrayLike,
    *,
    scan_L: ArrayLike | None = None,
    quadrotors: Sequence[QuadrotorParameters],
    cable: CableParameters | Sequence[CableParameters],
    gripper: GripperParameters | Sequence[GripperParameters],
    mass_ratio: float = 1.0,
    air: AirParameters | None = None,
) -> PayloadModelParameters:
    """Return the payload model that a controller uses under a belief.

    The beliefs differ in centre of mass and inertia alone.

    Parameters
    ----------
    belief : str
        "below_contact": the centre of mass is straight below the mean contact, at half the visible
        height; the inertia is that of a box of the visible extents.
        "geometric": centre of mass and inertia are those of the scan's closed hull, of uniform
        density.
        "true": centre of mass and inertia are the plant's.
    payload : Payload
        In L.
    p_LC : (n, 3)
        Contacts in L [m].
    scan_L : (N, 3), optional
        Scan of the payload in L, z up [m]; by default the vertices of its surface.
    quadrotors, cable, gripper : parameters, or sequences of n
        The true ones of the team; one cable or gripper means n equal ones.
    mass_ratio : float
        Believed mass of the payload over its true mass; scales its inertia too.
    air : AirParameters, optional
        The true ones. The shape in the air is the surface for the belief "true", else the hull of
        what is visible. None for no air.

    Raises
    ------
    InputError
        If the belief is unknown or the mass ratio is not positive.
    """
    if belief not in BELIEFS:
        raise InputError(f"`belief` must be one of {', '.join(BELIEFS)}, got {belief!r}")
    if not (np.isfinite(mass_ratio) and mass_ratio > 0.0):
        raise InputError(f"`mass_ratio` must be positive, got {mass_ratio!r}")
    contacts = np.asarray(p_LC, dtype=float).reshape(-1, 3)
    payload = replace(payload, mass=mass_ratio * payload.mass, inertia=mass_ratio * payload.inertia)
    mass, com, inertia = suspended_properties(payload, contacts, gripper)
    visible = payload.vertices if scan_L is None else np.asarray(scan_L, dtype=float)
    if belief == "below_contact":
        low, high = visible.min(axis=0), visible.max(axis=0)
        size = np.maximum(high - low, _MIN_SIZE)
        com = np.array([*contacts[:, :2].mean(axis=0), high[2] - 0.5 * size[2]])
        inertia = mass / 12.0 * (np.sum(size**2) * np.eye(3) - np.diag(size**2))
    elif belief == "geometric":
        hull = Payload.from_cloud(visible, mass, depth=_MIN_SIZE)
        com, inertia = hull.com, hull.inertia
    around: PayloadAir | None = None
    if air is not None:
        shape = payload if belief == "true" else Payload.from_cloud(visible, mass, depth=_MIN_SIZE)
        around = payload_air(shape.vertices, shape.faces, air)
    limits = np.array([q.thrust_limits for q in quadrotors])
    model = PayloadModelParameters(
        mass=mass,
        inertia=inertia,
        p_LC=contacts,
        p_LLcm=com,
        quadrotor_mass=np.array([q.mass for q in quadrotors]),
        cable_length=np.array([c.length for c in each(cable, len(contacts), "cables")]),
        min_thrust=limits[:, 0],
        max_thrust=limits[:, 1],
    )
    if air is None or around is None:
        return model
    return model.in_air(around, air.rotor_drag * model.quadrotor_mass)
