"""Payload, contacts and scan in the tracked frame L."""

import numpy as np
import pytest

from drake_aerial import geometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.suspended_payload import SuspendedPayload

SIZE = np.array([0.6, 0.4, 0.2])


def surface(rng, count=3000):
    points = rng.uniform(-0.5, 0.5, (count, 3))
    points[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-0.5, 0.5], count)
    return points * SIZE


def test_the_origin_is_the_scans_centroid():
    rng = np.random.default_rng(0)
    shift = np.array([3.0, -1.0, 0.5])
    scan = surface(rng) + shift
    box = Payload.from_box(SIZE, X_SP=Pose(shift, np.array([1.0, 0, 0, 0])))
    s = SuspendedPayload.from_contacts(box, [shift + [0.1, 0.1, 0.1]], [[0, 0, 1]], scan=scan)
    assert s.scan_L.mean(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    offset = scan.mean(axis=0) - shift
    assert s.payload.com == pytest.approx(-offset)
    assert s.p_LC[0] == pytest.approx([0.1, 0.1, 0.1] - offset)


def test_a_scan_whose_up_is_not_z_is_turned_upright():
    q = geometry.quat_from_two_vectors([0, 0, 1], [0, 1, 0])
    box = Payload.from_box(SIZE, X_SP=Pose(np.zeros(3), q))
    s = SuspendedPayload.from_contacts(box, [[0.0, 0.1, 0.0]], [[0, 1, 0]], up=(0, 1, 0))
    assert s.p_LC[0] == pytest.approx([0, 0, 0.1], abs=1e-12)
    assert s.normal_L[0] == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.ptp(s.payload.vertices, axis=0) == pytest.approx(SIZE)


def test_contacts_near_the_surface_are_moved_to_it_and_far_ones_refused():
    box = Payload.from_box(SIZE)
    s = SuspendedPayload.from_contacts(box, [[0.1, 0.0, 0.115]], [[0.1, 0, 1]])
    assert s.p_LC[0] == pytest.approx([0.1, 0.0, 0.1])
    assert s.normal_L[0] == pytest.approx([0, 0, 1])
    assert s.moved == pytest.approx([0.015])
    with pytest.raises(
        InputError,
        match=r"contact 2 of 2 must be at most 2 cm from the surface of payload 'box', got 3\.0 cm",
    ):
        SuspendedPayload.from_contacts(box, [[0, 0, 0.1], [0.0, 0.0, 0.13]], [[0, 0, 1]] * 2)


def test_a_scan_alone_gives_the_payload():
    rng = np.random.default_rng(1)
    scan = surface(rng)
    s = SuspendedPayload.from_contacts(None, [[0.1, 0.1, 0.1]], [[0, 0, 1]], scan=scan, mass=0.2)
    assert s.payload.mass == 0.2
    assert s.payload.com == pytest.approx(-scan.mean(axis=0), abs=3e-3)
    with pytest.raises(InputError, match="cm from the surface"):
        SuspendedPayload.from_contacts(None, [[0.1, 0.1, 0.2]], [[0, 0, 1]], scan=scan)
    with pytest.raises(InputError, match="neither"):
        SuspendedPayload.from_contacts(None, [[0.1, 0.1, 0.1]], [[0, 0, 1]])
    with pytest.raises(InputError, match="`mass` must not be given with"):
        SuspendedPayload.from_contacts(
            Payload.from_box(SIZE), [[0.1, 0.1, 0.1]], [[0, 0, 1]], mass=0.2
        )
