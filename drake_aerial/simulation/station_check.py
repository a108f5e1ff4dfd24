"""Checks of a station before it is built: contacts, time steps, lift and stability."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.elastic_step import check_elastic_step, tension_matrix
from drake_aerial.plant.part_checks import check_contact_distances, check_type
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.beliefs import suspended_properties
from drake_aerial.simulation.lift_check import check_lift
from drake_aerial.simulation.station_parameters import StationParameters


def check_contacts(payload: Payload, p_LC: ArrayLike, normal_L: ArrayLike) -> tuple[Array, Array]:
    """Return contacts and normals as arrays (n, 3) after checking them.

    Parameters
    ----------
    payload : Payload
        In L.
    p_LC : (n, 3) or (3,)
        Contacts in L [m].
    normal_L : (n, 3) or (3,)
        Outward normals at the contacts; one is for all.

    Raises
    ------
    InputError
        If an argument has the wrong type or shape or is not finite, or if a contact is too far from
        the payload's surface.
    """
    check_type("payload", payload, Payload)
    contacts, normals = _vectors("p_LC", p_LC), _vectors("normal_L", normal_L)
    if len(normals) not in (1, len(contacts)):
        raise InputError(
            f"`normal_L` must be (3,) or ({len(contacts)}, 3), one per contact, got {normals.shape}"
        )
    check_contact_distances(payload.contact_distances(contacts), payload.name)
    return contacts, np.broadcast_to(normals, contacts.shape)


def _vectors(name: str, values: ArrayLike) -> Array:
    """Return finite vectors as an array (n, 3), n >= 1."""
    try:
        vectors = np.atleast_2d(np.asarray(values, dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError(f"`{name}` must be an array (n, 3), got {values!r}") from error
    if vectors.ndim != 2 or vectors.shape[1] != 3 or len(vectors) == 0:
        raise InputError(f"`{name}` must have the shape (n, 3), n > 0, got {vectors.shape}")
    if not np.isfinite(vectors).all():
        raise InputError(f"`{name}` must be finite, got {vectors.tolist()}")
    return vectors


def check_station(
    payload: Payload, contacts: Array, parameters: StationParameters, force: bool = False
) -> None:
    """Raise InputError unless the team of a station can carry its payload.

    Parameters
    ----------
    payload : Payload
        In L.
    contacts : (n, 3) array
        In L [m].
    parameters : StationParameters
    force : bool
        Whether to accept a payload that the team cannot lift.

    Raises
    ------
    InputError
        If the time step, the attitude period or the slack is out of bounds, the payload is too
        heavy, or the step of the elastic cables is unstable.
    """
    n = len(contacts)
    if not (np.isfinite(parameters.step) and 0.0 < parameters.step <= 0.01):
        raise InputError(f"`time_step` must be in (0, 0.01] s, got {parameters.step!r}")
    held = parameters.attitude_period
    if not (held == 0.0 or (np.isfinite(held) and held >= parameters.step)):
        raise InputError(
            f"`attitude_period` must be 0 or at least the time step of {parameters.step:g} s, "
            f"got {held!r}"
        )
    shortest = float(parameters.cable_lengths(n).min())
    if not 0.0 <= parameters.initial_slack < 0.9 * shortest:
        raise InputError(
            f"`initial_slack` must be in [0, {0.9 * shortest:g}) m, 0.9 of the shortest cable, "
            f"got {parameters.initial_slack!r}"
        )
    quadrotors, cables = parameters.quadrotors(n), parameters.cables(n)
    mass, com, inertia = suspended_properties(payload, contacts, parameters.grippers(n))
    if not force:
        check_lift(payload, contacts - com, mass, quadrotors, cables)
    if cables[0].kind == "elastic":
        down = np.tile([0.0, 0.0, -1.0], (n, 1))
        masses = np.array([quadrotor.mass for quadrotor in quadrotors])
        matrix = tension_matrix(masses, mass, inertia, contacts - com, down)
        # Unequal cables are at least as stable as equal ones with the largest values.
        stiffest = replace(
            cables[0],
            stiffness=max(c.stiffness for c in cables),
            damping=max(c.damping for c in cables),
        )
        check_elastic_step(stiffest, parameters.step, float(np.linalg.eigvalsh(matrix).max()))
