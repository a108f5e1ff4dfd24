"""A gripper lets go above its holding force along the normal, with either kind of cable."""

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.plant.gripper import GripperParameters

WEIGHT = (0.25 + 0.25 + 0.002) * 9.81
KINDS = pytest.mark.parametrize("kind", ["inextensible", "elastic"])


@KINDS
@pytest.mark.parametrize(
    ("holding_force", "normal", "holds"),
    [
        (2.0, (0, 0, 1), False),
        (4.0, (0, 0, 1), True),
        (2.0, (1, 0, 0), True),
        (2.0, (0, 1, 1), True),
    ],
)
def test_it_holds_up_to_its_force_along_the_normal(rig, kind, holding_force, normal, holds):
    r = rig(kind, p_LC=[0, 0, 0.14], normal=normal, holding_force=holding_force, thrust=WEIGHT)
    # The elastic cable starts stretched as far as it is in equilibrium: no bounce.
    stretch = 0.252 * 9.81 / 5e3 if kind == "elastic" else 0.0
    r.place([0, 0, 3.0], [0, 0, 3.64 + stretch])
    r.simulator.AdvanceTo(0.5)
    assert bool(r.cables.attached(r.root)[0]) is holds
    if holds:
        assert abs(r.state("payload")[12]) < 0.05
    else:
        # Free fall since about the start, and no pull ever again.
        assert r.state("payload")[12] == pytest.approx(-9.81 * 0.5, rel=0.1)
        assert r.tension() < 0.05


@KINDS
def test_a_dropped_payload_stays_dropped(rig, kind):
    r = rig(kind, p_LC=[0, 0, 0.14], holding_force=2.0, thrust=WEIGHT, ground=True)
    r.place([0, 0, 0.3], [0, 0, 0.94])
    r.simulator.AdvanceTo(1.5)
    state = r.state("payload")
    assert not r.cables.attached(r.root)[0]
    assert state[6] == pytest.approx(r.payload.rest_height, abs=1e-3)
    assert np.abs(state[7:]).max() < 0.01
    assert r.state("quadrotor")[6] > 2.0


@pytest.mark.parametrize("bad", [{"holding_force": 0.0}, {"holding_force": np.nan}, {"mass": 0.0}])
def test_bad_parameters_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        GripperParameters(**bad)
