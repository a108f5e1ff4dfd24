"""What a station accepts: contacts, steps and a team that can carry its payload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import check_elastic_step, tension_matrix
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.beliefs import suspended_properties
from drake_aerial.simulation.lift_check import check_lift
from drake_aerial.simulation.station_parameters import StationParameters


def check_station(
    payload: Payload, contacts: Array, parameters: StationParameters, force: bool = False
) -> None:
    """Raise unless a payload can be carried at contacts (n, 3) in L [m] by what the parameters say; `force` accepts what is too heavy.

    Raises
    ------
    InputError
        For contacts that are none, a step, an attitude period or a slack out of bounds, a payload too heavy to lift, or elastic cables
        whose step is unstable.
    """
    n = len(contacts)
    if n == 0 or not np.isfinite(contacts).all():
        raise InputError(
            f"contacts of shape {contacts.shape} given; (n, 3) finite numbers, n >= 1, accepted"
        )
    if not (np.isfinite(parameters.step) and 0.0 < parameters.step <= 0.01):
        raise InputError(
            f"a time step of {parameters.step!r} s; above 0 and at most 0.01 s accepted"
        )
    held = parameters.attitude_period
    if not (held == 0.0 or (np.isfinite(held) and held >= parameters.step)):
        raise InputError(
            f"an attitude period of {held!r} s; 0, or at least the plant's step {parameters.step:g} s accepted"
        )
    shortest = float(parameters.cable_lengths(n).min())
    if not 0.0 <= parameters.initial_slack < 0.9 * shortest:
        raise InputError(
            f"an initial slack of {parameters.initial_slack!r} m; at least 0 and less than 0.9 of the shortest cable's "
            f"{shortest:g} m accepted"
        )
    quadrotors, cables = parameters.quadrotors(n), parameters.cables(n)
    mass, com, inertia = suspended_properties(payload, contacts, parameters.grippers(n))
    if not force:
        check_lift(payload, contacts - com, mass, quadrotors, cables)
    if cables[0].kind == "elastic":
        down = np.tile([0.0, 0.0, -1.0], (n, 1))
        masses = np.array([quadrotor.mass for quadrotor in quadrotors])
        matrix = tension_matrix(masses, mass, inertia, contacts - com, down)
        # Unequal cables are as stable as equal ones of the largest values at least.
        stiffest = replace(
            cables[0],
            stiffness=max(c.stiffness for c in cables),
            damping=max(c.damping for c in cables),
        )
        check_elastic_step(stiffest, parameters.step, float(np.linalg.eigvalsh(matrix).max()))
