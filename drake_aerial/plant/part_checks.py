"""Checks of the arguments of the `add_*` and `connect_*` functions."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.strict_yaml import numbers

MAX_CONTACT_DISTANCE = 0.02
"""Largest accepted distance of a contact from the payload's surface [m]."""

Parameters = TypeVar("Parameters")


def check_type(name: str, value: object, kind: type, advice: str = "") -> None:
    """Raise InputError unless `value` is a `kind`.

    Parameters
    ----------
    name : str
        Name of the argument.
    value : object
    kind : type
    advice : str
        How to get a `kind`, for example "as add_payload returns it".
    """
    if not isinstance(value, kind):
        wanted = f"{kind.__name__} {advice}".rstrip()
        raise InputError(f"`{name}` must be a {wanted}, got a {type(value).__name__}")


def check_list(name: str, values: object, kind: type, advice: str = "") -> None:
    """Raise InputError unless `values` is a sequence of one or more of a `kind`."""
    if not isinstance(values, Sequence) or len(values) == 0:
        got = "an empty one" if isinstance(values, Sequence) else f"a {type(values).__name__}"
        raise InputError(f"`{name}` must be a list of one or more {kind.__name__}, got {got}")
    for i, value in enumerate(values):
        check_type(f"{name}[{i}]", value, kind, advice)


def check_plant(plant: object, *, finalized: bool) -> None:
    """Raise InputError unless `plant` is a MultibodyPlant that is finalized, or not finalized."""
    check_type("plant", plant, MultibodyPlant)
    assert isinstance(plant, MultibodyPlant)
    if finalized and not plant.is_finalized():
        raise InputError("`plant` must be finalized: call plant.Finalize() before connecting parts")
    if not finalized and plant.is_finalized():
        raise InputError("`plant` must not be finalized: call plant.Finalize() after adding parts")


def parameters_or_default(value: Parameters | None, kind: type[Parameters]) -> Parameters:
    """Return `value`, or the default of its `kind` for None; raise InputError for another type."""
    if value is None:
        return kind()
    check_type("parameters", value, kind, "or None")
    return value


def unit_vector3(name: str, value: ArrayLike) -> Array:
    """Return `value` scaled to length 1, (3,); raise InputError if it has no direction."""
    vector = numbers(value, (3,), f"`{name}`")
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise InputError(f"`{name}` must not be zero: give the outward surface normal")
    return vector / length


def check_contact_distances(distances: Array, payload_name: str) -> None:
    """Raise InputError for the first of n contacts that is too far from the payload's surface.

    Parameters
    ----------
    distances : (n,) array
        Distances of the contacts from the surface [m].
    payload_name : str
    """
    for i, distance in enumerate(distances):
        if not distance <= MAX_CONTACT_DISTANCE:
            raise InputError(
                f"contact {i + 1} of {len(distances)} must be at most "
                f"{100 * MAX_CONTACT_DISTANCE:g} cm from the surface of payload {payload_name!r}, "
                f"got {100 * distance:.1f} cm"
            )


def refuse_world_body(plant: MultibodyPlant, *bodies: RigidBody) -> None:
    """Raise InputError if one of the bodies of a cable is the world body.

    Drake's SAP solver crashes the interpreter on a constraint to the world body (1.46 to 1.58). A
    body that is welded to the world is accepted by the solver.
    """
    for body in bodies:
        if body.index() == plant.world_body().index():
            raise InputError(
                "the bodies of a cable must not be the world body, on which Drake's SAP solver "
                "crashes: give a body that is welded to the world (plant.WeldFrames)"
            )
