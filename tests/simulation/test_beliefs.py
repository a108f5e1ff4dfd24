"""Believed mass properties, against the plant and against formulas."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from drake_aerial.choices import BELIEFS
from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters, add_cable
from drake_aerial.plant.gripper import GripperParameters, add_gripper
from drake_aerial.plant.payload import Payload
from drake_aerial.plant.payload_body import add_payload
from drake_aerial.plant.quadrotor import QuadrotorParameters, add_quadrotor
from drake_aerial.simulation.beliefs import believed_model

SIZE = np.array([0.6, 0.4, 0.2])
CONTACTS = np.array([[0.1, 0.05, 0.1], [-0.2, 0.1, 0.1]])
GRIPPER = GripperParameters(mass=0.01)


def believe(belief, payload, contacts=CONTACTS, **options):
    return believed_model(
        belief,
        payload,
        contacts,
        quadrotors=[QuadrotorParameters()] * len(contacts),
        cable=CableParameters(length=0.7),
        gripper=GRIPPER,
        **options,
    )


def test_the_true_belief_is_the_plants():
    payload = Payload.from_box(SIZE, 0.3, com=[0.03, -0.02, 0.01])
    plant = MultibodyPlant(0.002)
    body = add_payload(plant, payload)
    for i, contact in enumerate(CONTACTS):
        gripper = add_gripper(plant, body, contact, parameters=GRIPPER, name=f"gripper{i}")
        quadrotor = add_quadrotor(plant, name=f"quadrotor{i}")
        add_cable(plant, quadrotor, gripper, CableParameters("elastic"))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    bodies = [plant.GetBodyByName(name).index() for name in ("payload", "gripper0", "gripper1")]
    M = plant.CalcSpatialInertia(context, body.body.body_frame(), bodies)
    true = believe("true", payload)
    assert true.mass == pytest.approx(M.get_mass())
    assert true.p_LLcm == pytest.approx(M.get_com())
    about_com = M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    # The plant's grippers are small discs (radius 2 cm), the belief's are points.
    assert true.inertia == pytest.approx(about_com, abs=2 * GRIPPER.mass * 0.02**2)


def test_geometric_equals_true_for_a_uniform_box_with_light_grippers():
    payload = Payload.from_box(SIZE, 0.3)
    true, seen = believe("true", payload), believe("geometric", payload)
    assert seen.p_LLcm == pytest.approx(np.zeros(3), abs=1e-9)
    assert np.diag(seen.inertia) == pytest.approx(np.diag(true.inertia), rel=0.25)
    assert seen.mass == true.mass


def test_below_contact_is_below_the_mean_contact():
    payload = Payload.from_box(SIZE, 0.3, com=[0.1, 0.1, 0.05])
    model = believe("below_contact", payload)
    assert model.p_LLcm == pytest.approx([-0.05, 0.075, 0.0])
    a, b, c = SIZE**2
    assert np.diag(model.inertia) == pytest.approx(0.32 / 12 * np.array([b + c, a + c, a + b]))
    top = np.random.default_rng(0).uniform(-0.5, 0.5, (300, 3)) * SIZE
    top[:, 2] = 0.1
    assert believe("below_contact", payload, scan_L=top).p_LLcm[2] == pytest.approx(0.09)


def test_beliefs_differ_in_centre_of_mass_and_inertia_alone():
    payload = Payload.from_box(SIZE, 0.3, com=[0.1, 0.1, 0.05])
    models = [believe(b, payload) for b in BELIEFS]
    for name in (
        "mass",
        "p_LC",
        "quadrotor_mass",
        "cable_length",
        "thrust_lag",
        "min_thrust",
        "max_thrust",
    ):
        values = [np.asarray(getattr(m, name)) for m in models]
        assert all((v == values[0]).all() for v in values), name
    assert len({tuple(np.round(m.p_LLcm, 6)) for m in models}) == 3
    assert models[0].cable_length == pytest.approx([0.7, 0.7])


def test_an_unknown_belief_is_refused():
    with pytest.raises(InputError, match="below_contact, geometric, true"):
        believe("blind", Payload.from_box(SIZE))
