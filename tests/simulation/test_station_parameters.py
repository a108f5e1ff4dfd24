"""The station's time step depends on the kind of its cables."""

import pytest

from drake_aerial import StationParameters
from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters


@pytest.mark.parametrize(
    ("cable", "step"),
    [
        (CableParameters(), 0.005),
        (CableParameters("elastic"), 0.002),
        ((CableParameters(), CableParameters(length=0.8)), 0.005),
        ([CableParameters("elastic")] * 3, 0.002),
    ],
)
def test_the_default_step_depends_on_the_kind_of_cable(cable, step):
    assert StationParameters(cable=cable).step == step
    assert StationParameters(cable=cable, time_step=1e-3).step == 1e-3
    assert StationParameters(cable=cable).with_cable_kind("elastic").step == 0.002


def test_a_bad_step_is_refused():
    for bad in (0.0, -1e-3, float("nan")):
        with pytest.raises(InputError, match="time_step"):
            StationParameters(time_step=bad)
