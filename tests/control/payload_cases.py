"""Models and random states that several control tests share."""

import numpy as np

from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.geometry import matrix_from_quat, random_rotation
from drake_aerial.plant.air import PayloadAir


def random_model(n, seed=0):
    rng = np.random.default_rng(seed)
    turn = matrix_from_quat(random_rotation(rng))
    return PayloadModelParameters(
        mass=0.4,
        inertia=turn @ np.diag([0.006, 0.0059, 0.0107]) @ turn.T,
        p_LC=rng.uniform(-0.3, 0.3, (n, 3)) + [0.0, 0.0, 0.2],
        p_LLcm=[0.02, -0.03, 0.01],
        quadrotor_mass=rng.uniform(0.2, 0.5, n),
        cable_length=rng.uniform(0.4, 0.9, n),
        thrust_lag=rng.uniform(0.04, 0.15, (n, 3)),
    )


def random_state(n, batch, seed=0, rates=1.0):
    rng = np.random.default_rng(seed)
    xi = np.array([0.0, 0.0, -1.0]) + rng.normal(0.0, 0.4, (batch, n, 3))
    xi /= np.linalg.norm(xi, axis=-1, keepdims=True)
    w = rates * rng.normal(0.0, 1.5, (batch, n, 3))
    w -= xi * (w * xi).sum(-1, keepdims=True)
    return PayloadState(
        rng.normal(0.0, 1.0, (batch, 3)),
        rng.normal(0.0, 1.0, (batch, 3)),
        matrix_from_quat(random_rotation(rng, batch)),
        rates * rng.normal(0.0, 1.5, (batch, 3)),
        xi,
        w,
        rng.normal(0.0, 1.0, (batch, n, 3)) + [0.0, 0.0, 4.0],
    )


def random_input(n, batch, seed=0):
    return np.random.default_rng(seed + 100).normal(0.0, 1.0, (batch, n, 3)) + [0.0, 0.0, 4.0]


def random_model_in_air(n, seed=0):
    """The random model with drag, whose centre is off the centre of mass, and air that moves."""
    rng = np.random.default_rng(seed + 50)
    turn = matrix_from_quat(random_rotation(rng))
    drag = turn @ np.diag([0.05, 0.08, 0.2]) @ turn.T
    air = PayloadAir(drag, np.array([0.05, -0.08, 0.03]), 0.15, np.diag([2e-3, 3e-3, 4e-3]))
    return random_model(n, seed).in_air(air, rng.uniform(0.1, 0.3, n))
