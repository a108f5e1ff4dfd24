import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.math import SpatialVelocity
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    MultibodyForces,
    RotationalInertia,
    SpatialInertia,
)

from drake_aerial.errors import InputError
from drake_aerial.estimation.inertial_parameters import (
    InertialParameters,
    inertia_matrix,
    pseudo_inertia,
    regressor,
)

COM = np.array([0.07, -0.03, 0.11])
INERTIA = np.array([[0.02, 0.003, -0.001], [0.003, 0.03, 0.002], [-0.001, 0.002, 0.025]])
BODY = InertialParameters(0.7, COM, INERTIA)


def test_the_vector_holds_the_parameters():
    back = InertialParameters.from_vector(BODY.to_vector())
    assert back.mass == BODY.mass
    np.testing.assert_allclose(back.com, COM, rtol=1e-14)
    np.testing.assert_allclose(back.inertia, INERTIA, atol=1e-15)


def test_the_regressor_agrees_with_drakes_inverse_dynamics():
    plant = MultibodyPlant(0.0)
    J = INERTIA
    about_com = RotationalInertia(J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2])
    body = plant.AddRigidBody("b", SpatialInertia.MakeFromCentralInertia(0.7, COM, about_com))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    rng = np.random.default_rng(3)
    for _ in range(5):
        X_WL = RigidTransform(RollPitchYaw(rng.uniform(-1, 1, 3)), rng.normal(size=3))
        w, v, w_dot, v_dot = rng.normal(size=(4, 3))
        plant.SetFreeBodyPose(context, body, X_WL)
        plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity(w, v))
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        wrench_W = plant.CalcInverseDynamics(context, np.concatenate([w_dot, v_dot]), forces)
        R = X_WL.rotation().matrix()
        Y = regressor(R.T @ v_dot, R.T @ w, R.T @ w_dot, R.T @ [0.0, 0.0, -9.81])
        force, moment = np.split(Y @ BODY.to_vector(), 2)
        np.testing.assert_allclose(R @ moment, wrench_W[:3], atol=1e-12)
        np.testing.assert_allclose(R @ force, wrench_W[3:], atol=1e-12)


def test_point_masses_have_a_pseudo_inertia_of_their_second_moments():
    rng = np.random.default_rng(4)
    masses, points = rng.uniform(0.1, 1.0, 6), rng.normal(size=(6, 3))
    homogeneous = np.column_stack([points, np.ones(6)])
    com = masses @ points / masses.sum()
    arm = points - com
    J = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(masses, arm))
    phi = InertialParameters(masses.sum(), com, J).to_vector()
    expected = (homogeneous * masses[:, None]).T @ homogeneous
    np.testing.assert_allclose(pseudo_inertia(phi), expected, atol=1e-12)


def test_an_impossible_inertia_has_an_indefinite_pseudo_inertia():
    phi = InertialParameters(1.0, np.zeros(3), np.diag([0.1, 0.1, 0.3])).to_vector()
    assert np.linalg.eigvalsh(pseudo_inertia(phi))[0] < 0.0
    np.testing.assert_allclose(inertia_matrix(phi), np.diag([0.1, 0.1, 0.3]))


def test_no_mass_is_refused():
    with pytest.raises(InputError, match="positive"):
        InertialParameters.from_vector(np.zeros(10))
