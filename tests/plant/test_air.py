"""Air: drag of hulls beside wind-tunnel values, rotor drag, and the air that moves along."""

import numpy as np
import pytest
import trimesh

from drake_aerial.plant.air import AirParameters, payload_air, payload_drag, rotor_drag
from drake_aerial.plant.payload import Payload

AIR = AirParameters()


def air_of(mesh):
    return payload_air(np.array(mesh.vertices), np.array(mesh.faces), AIR)


def coefficient(air, direction, area):
    """Drag coefficient along the flow, for an area."""
    d = np.asarray(direction) / np.linalg.norm(direction)
    return float(payload_drag(air.drag, 5.0 * d) @ d) / (0.5 * AIR.density * 25.0 * area)


def test_a_box_in_a_flow_along_its_axes_has_its_coefficient():
    box = Payload.from_box([0.5, 0.3, 0.2])
    air = payload_air(box.vertices, box.faces, AIR)
    for axis, area in zip(np.eye(3), (0.06, 0.1, 0.15), strict=True):
        assert coefficient(air, axis, area) == pytest.approx(1.05)


@pytest.mark.parametrize(
    ("mesh", "direction", "area", "measured"),
    [
        # Frontal area; Hoerner, Fluid-Dynamic Drag (1965), and tables after him.
        (trimesh.creation.box((1.0, 1.0, 1.0)), (1.0, 1.0, 0.0), np.sqrt(2.0), 0.80),
        (trimesh.creation.cylinder(0.5, 2.0), (1.0, 0.0, 0.0), 2.0, 0.68),
        (trimesh.creation.cylinder(0.5, 5.0), (1.0, 0.0, 0.0), 5.0, 0.74),
        (trimesh.creation.cylinder(0.5, 1.0), (0.0, 0.0, 1.0), np.pi / 4, 0.91),
        (trimesh.creation.box((1.0, 1.0, 0.01)), (0.0, 0.0, 1.0), 1.0, 1.17),
    ],
)
def test_drag_is_that_of_a_wind_tunnel_within_a_quarter(mesh, direction, area, measured):
    assert coefficient(air_of(mesh), direction, area) == pytest.approx(measured, rel=0.25)


def test_a_sphere_has_two_thirds_of_the_coefficient_of_a_face():
    sphere = air_of(trimesh.creation.icosphere(4, radius=0.3))
    assert coefficient(sphere, (1.0, 2.0, -0.5), np.pi * 0.09) == pytest.approx(0.70, rel=0.01)


def test_drag_turns_with_the_payload_and_never_drives_it():
    box = Payload.from_box([0.5, 0.3, 0.2])
    turn = trimesh.transformations.random_rotation_matrix(np.array([0.2, 0.5, 0.7]))[:3, :3]
    still, turned = (payload_air(v, box.faces, AIR) for v in (box.vertices, box.vertices @ turn.T))
    np.testing.assert_allclose(turned.drag, turn @ still.drag @ turn.T, atol=1e-12)
    velocity = np.random.default_rng(0).normal(size=(100, 3))
    assert (np.vecdot(payload_drag(turned.drag, velocity), velocity) > 0.0).all()


def test_a_closed_box_carries_the_air_that_it_displaces():
    """A scale shows a closed box without the weight of the air inside, which buoyancy balances."""
    box = Payload.from_box([0.68, 0.61, 0.28])
    air = payload_air(box.vertices + [0.1, 0.0, 0.0], box.faces, AirParameters(added_mass=0.0))
    assert air.mass == pytest.approx(1.225 * 0.68 * 0.61 * 0.28)
    np.testing.assert_allclose(air.centre, [0.1, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(air.inertia[0, 0], air.mass * (0.61**2 + 0.28**2) / 12.0, rtol=1e-9)
    assert payload_air(box.vertices, box.faces[:-1], AIR).mass == 0.0


def test_rotor_drag_acts_across_the_thrust_alone():
    z = np.array([[0.6, 0.0, 0.8], [0.0, 0.0, 1.0]])
    along = rotor_drag(np.full(2, 0.2), z, 3.0 * z)
    np.testing.assert_allclose(along, 0.0, atol=1e-15)
    level = rotor_drag(np.array([0.2, 0.3]), z, np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 5.0]]))
    np.testing.assert_allclose(level, [[0.0, 0.4, 0.0], [0.3, 0.0, 0.0]], atol=1e-15)
