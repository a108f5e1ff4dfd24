from dataclasses import replace

import numpy as np
import pytest

from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload, identify_payload
from drake_aerial.errors import InputError
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation.recorded_motion import gripper_masses, recorded_motion

THREE = [[0.15, 0.1, 0.1], [-0.15, 0.1, 0.1], [0.0, -0.15, 0.1]]


@pytest.fixture(scope="module", params=[[[0.0, 0.0, 0.1]], THREE], ids=["one", "three"])
def trial(request):
    box = replace(Payload.from_box([0.4, 0.4, 0.2], 0.4), com=np.array([0.05, -0.03, -0.02]))
    contacts = np.array(request.param)
    held = SuspendedPayload.from_contacts(box, contacts, [[0.0, 0.0, 1.0]] * len(contacts))
    options = FlightOptions(trajectory=HoverTrajectory(hover_time=1.5), belief="true")
    return Flight(held, options).run(0)


@pytest.mark.parametrize("forces", ["thrust", "tension"])
def test_a_hover_tells_mass_and_the_line_of_the_centre_of_mass(trial, forces):
    motion = recorded_motion(trial, forces)
    result = identify_payload(motion, trial.vertices, gripper_mass=gripper_masses(trial))
    assert result.parameters.mass == pytest.approx(0.4, rel=1e-3)
    off = result.parameters.com - [0.05, -0.03, -0.02]
    down = motion.R_WL[-1].T @ [0.0, 0.0, -1.0]
    assert np.linalg.norm(off - down * (down @ off)) < 1e-3
    assert off @ np.linalg.solve(result.com_covariance, off) < 16.3  # 99.9 %


def test_the_payload_counts_as_carried_only_above_the_ground(trial):
    motion = recorded_motion(trial)
    lowest = trial.vertices @ motion.R_WL[:, 2].T + motion.p_WL[:, 2]
    assert (lowest.min(axis=0)[motion.carried] > 0.01).all()


def test_unknown_forces_and_missing_masses_are_refused(trial):
    with pytest.raises(InputError, match="thrust or tension"):
        recorded_motion(trial, "wind")
    with pytest.raises(InputError, match=r"configuration\.station\.quadrotor"):
        recorded_motion(replace(trial, metrics={}))
