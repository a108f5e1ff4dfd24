from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import LinearSpringDamper, RotationalInertia, SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from scipy.stats import chi2

from drake_aerial.errors import InputError, JobError
from drake_aerial.estimation.mass_identification import identify_payload
from drake_aerial.estimation.momentum_windows import PayloadMotion
from drake_aerial.geometry import matrix_from_quat, quat_exp

CORNERS = np.array(np.meshgrid([-0.3, 0.3], [-0.2, 0.2], [-0.1, 0.1])).reshape(3, -1).T
CONTACTS = np.array([[-0.2, 0.1, 0.1], [0.2, 0.15, 0.1], [0.05, -0.18, 0.1]])
MASS, COM = 0.8, np.array([0.05, -0.04, 0.02])
INERTIA = np.array([[0.012, 0.001, 0.0], [0.001, 0.022, -0.002], [0.0, -0.002, 0.03]])
ANCHORS = np.array([[-0.4, 0.2, 1.0], [0.5, 0.3, 1.1], [0.0, -0.5, 1.2]])
STIFFNESS, LENGTH = 30.0, 0.8


@pytest.fixture(scope="module")
def swinging() -> PayloadMotion:
    """A body that Drake integrates as it swings from three springs of known force."""
    plant = MultibodyPlant(0.0)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -9.81])
    J = INERTIA
    about_com = RotationalInertia(J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    body = plant.AddRigidBody("b", SpatialInertia.MakeFromCentralInertia(MASS, COM, about_com))
    for anchor, contact in zip(ANCHORS, CONTACTS):
        spring = LinearSpringDamper(
            plant.world_body(), anchor, body, contact, LENGTH, STIFFNESS, 0.0
        )
        plant.AddForceElement(spring)
    plant.Finalize()
    simulator = Simulator(plant)
    integrator = ResetIntegratorFromFlags(simulator, "runge_kutta3", 0.01)
    integrator.set_target_accuracy(1e-8)
    context = simulator.get_mutable_context()
    plant.SetFreeBodyPose(context, body, RigidTransform(RollPitchYaw(0.3, -0.2, 0.4), [0, 0, 0]))
    spin = SpatialVelocity(np.array([0.5, -0.8, 1.0]), np.array([0.3, 0.2, 0.0]))
    plant.SetFreeBodySpatialVelocity(context, body, spin)
    time = np.arange(301) * 0.01
    poses, velocities = [], []
    for t in time:
        simulator.AdvanceTo(t)
        poses.append(plant.EvalBodyPoseInWorld(context, body))
        velocities.append(plant.EvalBodySpatialVelocityInWorld(context, body))
    R = np.stack([X.rotation().matrix() for X in poses])
    p = np.stack([X.translation() for X in poses])
    w = np.stack([V.rotational() for V in velocities])
    stretched = ANCHORS - (p[:, None] + np.einsum("tij,nj->tni", R, CONTACTS))
    size = np.linalg.norm(stretched, axis=-1, keepdims=True)
    return PayloadMotion(
        time=time,
        p_WL=p,
        v_WL=np.stack([V.translational() for V in velocities]),
        R_WL=R,
        W_L=np.einsum("tji,tj->ti", R, w),
        p_LC=CONTACTS,
        force=STIFFNESS * (size - LENGTH) * stretched / size,
        momentum=np.zeros((len(time), 3, 3)),
        attached=np.ones((len(time), 3), bool),
        carried=np.ones(len(time), bool),
        other=np.zeros((len(time), 6)),
    )


def test_exact_motion_gives_the_exact_parameters(swinging):
    result = identify_payload(swinging, CORNERS)
    assert result.parameters.mass == pytest.approx(MASS, rel=1e-5)
    np.testing.assert_allclose(result.parameters.com, COM, atol=2e-6)
    np.testing.assert_allclose(result.parameters.inertia, INERTIA, atol=2e-5)
    assert not result.constrained
    assert len(result.unobservable) == 0


def test_the_mass_of_the_grippers_is_taken_off(swinging):
    result = identify_payload(swinging, CORNERS, gripper_mass=[0.05, 0.02, 0.03])
    rest = result.parameters
    assert rest.mass == pytest.approx(MASS - 0.1, rel=1e-4)
    moment = MASS * COM - np.array([0.05, 0.02, 0.03]) @ CONTACTS
    np.testing.assert_allclose(rest.mass * rest.com, moment, atol=1e-5)


def test_a_quadrotors_balance_says_what_its_cable_says(swinging):
    # Any motion of the quadrotors: force + weight - d(momentum)/dt is the same pull.
    rng = np.random.default_rng(5)
    phase, speed = rng.uniform(0, 6, (3, 3)), rng.uniform(2.0, 4.0, (3, 3))
    t = swinging.time[:, None, None]
    momentum = 0.4 * np.sin(speed * t + phase)
    rate = 0.4 * speed * np.cos(speed * t + phase)
    balance = replace(swinging, force=swinging.force + rate, momentum=momentum)
    result = identify_payload(balance, CORNERS)
    assert result.parameters.mass == pytest.approx(MASS, rel=1e-4)
    np.testing.assert_allclose(result.parameters.com, COM, atol=1e-4)


def test_a_known_force_such_as_drag_is_accounted_for(swinging):
    # Move a part of the springs' pull to `other`: force at L's origin and its moment.
    R, part = swinging.R_WL, 0.3 * swinging.force
    moment = np.cross(np.einsum("tij,nj->tni", R, CONTACTS), part).sum(axis=1)
    other = np.concatenate([part.sum(axis=1), moment], axis=1)
    moved = replace(swinging, force=swinging.force - part, other=other)
    result = identify_payload(moved, CORNERS)
    np.testing.assert_allclose(result.parameters.com, COM, atol=1e-5)


def hanging(R: np.ndarray, seconds: float = 2.0) -> PayloadMotion:
    """A body at rest below one cable that carries it."""
    T = round(100 * seconds) + 1
    zeros = np.zeros((T, 3))
    force = np.zeros((T, 1, 3))
    force[..., 2] = 9.81 * MASS
    return PayloadMotion(
        time=np.arange(T) * 0.01,
        p_WL=zeros,
        v_WL=zeros,
        R_WL=np.tile(R, (T, 1, 1)),
        W_L=zeros,
        p_LC=(COM + R.T @ [0.0, 0.0, 0.13])[None],
        force=force,
        momentum=np.zeros((T, 1, 3)),
        attached=np.ones((T, 1), bool),
        carried=np.ones(T, bool),
        other=np.zeros((T, 6)),
    )


def test_one_hang_tells_the_line_of_the_centre_of_mass_and_nothing_along_it():
    R = matrix_from_quat(quat_exp(np.array([0.4, -0.5, 0.2])))
    result = identify_payload(hanging(R), CORNERS)
    assert result.parameters.mass == pytest.approx(MASS, rel=1e-6)
    np.testing.assert_allclose(np.abs(result.unobservable @ R.T[:, 2]), [1.0], atol=1e-3)
    off = result.parameters.com - COM
    down = R.T[:, 2]
    np.testing.assert_allclose(off - down * (down @ off), 0.0, atol=1e-5)
    along = np.sqrt(down @ result.com_covariance @ down)
    assert 0.1 < along < 0.4
    assert abs(down @ off) < 3.0 * along


def test_standard_deviations_fit_the_errors_of_noisy_records(swinging):
    errors = []
    for seed in range(24):
        rng = np.random.default_rng(seed)
        noise = rng.normal(size=(3, *swinging.force.shape))
        noisy = replace(
            swinging,
            force=(1.0 + 2e-3 * rng.normal(size=(3, 1))) * swinging.force + 0.02 * noise[0],
            v_WL=swinging.v_WL + 0.01 * noise[1, :, 0],
            W_L=swinging.W_L + 0.02 * noise[2, :, 0],
            R_WL=swinging.R_WL @ matrix_from_quat(quat_exp(2e-3 * rng.normal(size=3))),
        )
        result = identify_payload(noisy, CORNERS)
        e = result.parameters.com - COM
        errors.append(e @ np.linalg.solve(result.com_covariance, e))
    # The mean of 24 values of chi-square with 3 degrees of freedom, between 1 % and 99.9 %.
    low, high = chi2.ppf([0.01, 0.999], 3 * 24) / 24
    assert low < np.mean(errors) < high


def test_impossible_records_give_the_nearest_possible_body(swinging):
    small = 0.02 * CORNERS + [0.1, 0.0, 0.0]
    result = identify_payload(swinging, small)
    assert result.constrained
    body = result.parameters
    assert (body.com >= small.min(axis=0) - 1e-6).all()
    assert (body.com <= small.max(axis=0) + 1e-6).all()
    moments = np.linalg.eigvalsh(body.inertia)
    assert moments[0] > -1e-9
    assert moments[2] <= moments[0] + moments[1] + 1e-6


def test_windows_on_the_ground_and_across_a_release_are_left_out(swinging):
    spoiled = swinging.force.copy()
    spoiled[:80] = 99.0
    carried = np.arange(301) >= 80
    result = identify_payload(replace(swinging, force=spoiled, carried=carried), CORNERS)
    np.testing.assert_allclose(result.parameters.com, COM, atol=1e-4)
    # A gripper that lets go at 1.5 s: of 14 windows of 0.4 s, those from 1.2 and 1.4 s span it.
    attached = swinging.attached.copy()
    attached[150:, 0] = False
    assert identify_payload(swinging, CORNERS).windows == 14
    assert identify_payload(replace(swinging, attached=attached), CORNERS).windows == 12


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"force": np.zeros((301, 2, 3))}, InputError, "`force` must have shape"),
        ({"v_WL": np.full((301, 3), np.nan)}, InputError, "`v_WL` must be finite"),
        ({"time": np.arange(301.0) ** 2}, InputError, "constant interval"),
        ({"carried": np.zeros(301, bool)}, JobError, "at least 4 windows"),
        ({"force": np.zeros((301, 3, 3))}, JobError, "never pulled"),
    ],
)
def test_bad_records_are_refused(swinging, change, error, message):
    with pytest.raises(error, match=message):
        identify_payload(replace(swinging, **change), CORNERS)


def test_negative_gripper_masses_are_refused(swinging):
    with pytest.raises(InputError, match="gripper_mass"):
        identify_payload(swinging, CORNERS, gripper_mass=-1.0)
