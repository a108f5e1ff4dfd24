"""Air: its parameters, the drag of a payload's hull and of rotors, and the added mass.

Plant, controllers and estimators use the same functions. Velocities are those of the air relative
to the body, so that a force has the direction of the velocity, not against it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from drake_aerial.geometry import Array, cross
from drake_aerial.io.records import NonNegative, Positive, record
from drake_aerial.plant.mass_properties import SolidProperties, is_closed, solid_properties


@record(frozen=True)
class AirParameters:
    """Air around payload and quadrotors: drag, and the added mass of the payload.

    Not modelled: the drag of cables and grippers, the moment of the air about the payload's centre
    of drag, vortex shedding, and the effect of inflow on the propellers' thrust.

    Examples
    --------
    >>> from drake_aerial.plant.air import AirParameters
    >>> AirParameters(density=1.0).payload_drag
    1.05
    """

    density: Positive = 1.225
    """Density of the air [kg/m^3]; 1.225 at sea level and 15 degrees C."""
    payload_drag: NonNegative = 1.05
    """Drag coefficient of the payload for a face normal to the flow (dimensionless); 1.05 is that
    of a cube (Hoerner, Fluid-Dynamic Drag, 1965)."""
    rotor_drag: NonNegative = 0.465
    """Rotor drag of a quadrotor across its thrust, over its mass and speed [1/s]. 0.465 is the mean
    of the 0.544 and 0.386 along x and y that Faessler, Franchi and Scaramuzza identified
    ("Differential Flatness of Quadrotor Dynamics Subject to Rotor Drag", RA-L 2018); along the
    thrust they found none."""
    added_mass: NonNegative = 0.68
    """Mass of the outer air that is accelerated with the payload, over the mass of the air that it
    displaces (dimensionless); 0.68 is that of a cube (DNV-RP-H103), 0.5 that of a sphere."""


@dataclass(frozen=True, eq=False)
class PayloadAir:
    """Drag and added mass of one payload, in the axes of the frame of its vertices.

    Attributes
    ----------
    drag : (3, 3) array
        Matrix K of the force |v| K v of air that moves at v relative to the centre [kg/m].
    centre : (3,) array
        Centre of drag and of the displaced volume [m].
    mass : float
        Mass of the air that is accelerated with the payload and has no weight [kg].
    inertia : (3, 3) array
        Inertia of the displaced part of that air about the centre [kg m^2].
    """

    drag: Array
    centre: Array
    mass: float
    inertia: Array


def payload_air(vertices: Array, faces: Array, air: AirParameters) -> PayloadAir:
    """Return drag and added mass of a payload.

    Each panel of the convex hull feels a pressure proportional to the cosine between its normal
    and the flow, so that K = density / 2 c_D sum a n n^T / 2 over panels of area a and normal n. A
    box in a flow along its axes has the drag coefficient c_D, a plate the normal force of its
    incidence, a long cylinder across the flow pi / 4 c_D, a sphere 2 / 3 c_D.

    A closed payload whose scale shows m in air has the inertial mass m + density V, whether it
    encloses air or is solid, because the scale does not show its buoyancy. Its surface must be
    closed for that; otherwise no air moves along.

    Parameters
    ----------
    vertices, faces : (V, 3) array [m], (F, 3) int array
        Surface of the payload.
    air : AirParameters
    """
    hull = ConvexHull(vertices)
    a, b, c = np.moveaxis(vertices[hull.simplices], 1, 0)
    normal = 0.5 * cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    normals, areas = normal[area > 0.0] / area[area > 0.0, None], area[area > 0.0]
    K = 0.25 * air.density * air.payload_drag * np.einsum("k,ki,kj->ij", areas, normals, normals)
    hull_centre = np.average((a + b + c)[area > 0.0] / 3.0, axis=0, weights=areas)
    solid = solid_properties(vertices, faces)
    if not is_closed(faces) or solid.volume <= 1e-9 * float(np.ptp(vertices, axis=0).max()) ** 3:
        solid = SolidProperties(0.0, hull_centre, np.zeros((3, 3)))
    displaced = air.density * solid.volume
    mass = (1.0 + air.added_mass) * displaced
    return PayloadAir(K, solid.centroid if mass else hull_centre, mass, solid.inertia(displaced))


def payload_drag(drag: Array, velocity: Array) -> Array:
    """Return the drag |v| K v (..., 3) [N] of air moving at `velocity` (..., 3) [m/s].

    Parameters
    ----------
    drag : (3, 3) array
        K, in the payload's axes [kg/m].
    velocity : (..., 3) array
        Of the air relative to the centre of drag, in the payload's axes [m/s].
    """
    return np.sqrt(np.vecdot(velocity, velocity))[..., None] * (velocity @ drag)


def rotor_drag(coefficient: Array, axis: Array, velocity: Array) -> Array:
    """Return the drag c (v - z z.v) (..., 3) [N] of rotors.

    Parameters
    ----------
    coefficient : (...) array
        c [kg/s].
    axis, velocity : (..., 3) arrays
        Direction z of the thrust, and velocity of the air relative to the quadrotor [m/s], in the
        same axes.
    """
    along = np.vecdot(axis, velocity)[..., None]
    return np.asarray(coefficient)[..., None] * (velocity - along * axis)
