import numpy as np
import pytest
import trimesh

from drake_aerial.errors import InputError
from drake_aerial.plant.downwash import ROTOR_RADIUS, SPREAD, downwash_share
from drake_aerial.plant.payload import Payload


def test_a_wide_payload_takes_the_whole_momentum_of_the_jet():
    assert downwash_share(Payload.from_box([4.0, 4.0, 0.2]), np.zeros(3), 1.0) == pytest.approx(
        1.0, abs=1e-3
    )
    assert downwash_share(Payload.from_box([0.2, 0.2, 0.2]), [5.0, 0.0, 0.1], 1.0) == 0.0


@pytest.mark.parametrize("length", [0.5, 1.0, 3.0])
def test_a_disc_takes_the_share_within_its_radius(length):
    """A Gaussian jet of radius b keeps 1 - exp(-2 r^2 / b^2) of its momentum within r."""
    disc = Payload.from_mesh(trimesh.creation.cylinder(0.25, 0.1, sections=128))
    b = (1.0 + ROTOR_RADIUS) * 0.10 + SPREAD * length
    expected = 1.0 - np.exp(-2.0 * 0.25**2 / b**2)
    assert downwash_share(disc, np.zeros(3), length) == pytest.approx(expected, abs=0.02)


def test_a_longer_cable_brings_less_downwash():
    box = Payload.from_box([0.68, 0.61, 0.28])
    shares = [downwash_share(box, [0.0, 0.0, 0.14], length) for length in (0.5, 1.0, 3.0, 5.0)]
    assert shares[0] > 0.9
    assert (np.diff(shares) < 0.0).all()
    with pytest.raises(InputError, match="`cable_length` must be in"):
        downwash_share(box, np.zeros(3), 0.0)
