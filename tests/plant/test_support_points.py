"""Every payload stays where and as it was put on the ground."""

import numpy as np
import pytest

from drake_aerial.io import model_files
from drake_aerial.plant import support_points as support
from drake_aerial.plant import triangles
from drake_aerial.plant.payload import Payload


@pytest.mark.parametrize("name", model_files.names("payloads"))
def test_shipped_payloads_rest(rig, name):
    payload = Payload.read(name)
    payload = payload.in_tracked_frame(payload.vertices.mean(axis=0))
    top = payload.vertices[np.argmax(payload.vertices[:, 2])]
    r = rig(payload=payload, p_LC=top, ground=True, thrust=0.25 * 9.81)
    at = np.array([0.0, 0.0, r.payload.rest_height])
    r.place(at, at + top + [0, 0, 0.4])
    r.simulator.AdvanceTo(1.5)
    state = r.state("payload")
    assert np.linalg.norm(state[4:7] - at) < 1e-3
    assert 2 * np.arccos(min(1.0, abs(state[0]))) < 0.005
    assert np.abs(state[7:]).max() < 1e-3


def test_a_box_stands_on_its_own_corners():
    vertices, _ = triangles.box(np.array([0.6, 0.4, 0.2]))
    feet, own = support.feet(vertices, np.array([0.1, 0.0, 0.0]))
    assert own
    assert {tuple(np.round(f, 6)) for f in feet} == {
        (x, y, -0.1) for x in (-0.3, 0.3) for y in (-0.2, 0.2)
    }


def test_what_would_topple_stands_on_a_cradle():
    # A tall wedge standing on a thin edge, and a centre of mass beside the base.
    vertices = np.array(
        [
            [-0.01, -0.2, 0],
            [0.01, -0.2, 0],
            [0, 0.2, 0],
            [0.3, 0.2, 0.5],
            [0.3, -0.2, 0.5],
            [-0.1, 0, 0.5],
        ]
    )
    com = np.array([0.15, 0.0, 0.3])
    feet, own = support.feet(vertices, com)
    assert not own
    assert feet[:, 2] == pytest.approx(0.0)
    assert support._margin(feet[:, :2], com[:2]) > 0.0
    far = np.array([0.8, 0.0, 0.3])
    assert support._margin(support.feet(vertices, far)[0][:, :2], far[:2]) > 0.0


def test_few_feet_even_for_a_round_base():
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(200)])
    feet, own = support.feet(np.concatenate([ring, 0.5 * ring + [0, 0, 1]]), np.array([0, 0, 0.4]))
    assert own
    assert len(feet) <= 6
    assert support._margin(feet[:, :2], np.zeros(2)) > 0.5
