"""A light closed loop: payload model, rigid attitudes, a 50 Hz sensor, and any controller."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantValueSource, ZeroOrderHold
from scipy.spatial.transform import Rotation

from drake_aerial.control.attitude import AttitudeController
from drake_aerial.dynamics.payload_model import PayloadState
from drake_aerial.geometry import cross, quat_from_matrix
from tests.control.test_allocation import CROSS
from tests.dynamics.integration import integrate

QUADROTOR_INERTIA = np.diag([6e-4, 5e-4, 1e-3])


class LightPlant(LeafSystem):
    """Discrete plant: the payload model, with the attitudes of rigid quadrotors."""

    def __init__(self, model, x, propellers, step):
        super().__init__()
        n = model.n
        self.model, self.step, self.propellers = model, step, propellers
        self.x, self.R_WQ, self.W_Q = x, np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
        self.log = {"t": [], "p": [], "v": [], "R": [], "T": [], "x": []}
        self.DeclareVectorInputPort("commands", 4 * n)
        # The plant's state is not in the context: this plant is for a single simulation.
        self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(step, 0.0, self._advance)
        for name, size in (
            ("payload_state", 13),
            ("quadrotor_states", 13 * n),
            ("cable_directions", 6 * n),
        ):
            ticket = {self.all_state_ticket()}
            self.DeclareVectorOutputPort(name, size, getattr(self, "_" + name), ticket)

    def _advance(self, context, discrete):
        commands = self.GetInputPort("commands").Eval(context).reshape(-1, 4)
        wrench = np.array([p.wrench(c) for p, c in zip(self.propellers, commands)])
        h, J = self.step, QUADROTOR_INERTIA
        for i in range(self.model.n):
            W = self.W_Q[i]
            W = W + h * np.linalg.solve(J, wrench[i, 1:] - np.cross(W, J @ W))
            self.R_WQ[i] = self.R_WQ[i] @ Rotation.from_rotvec(h * W).as_matrix()
            self.W_Q[i] = W
        F = (wrench[:, 0, None] * self.R_WQ[:, :, 2])[None]
        x = self.x._replace(F=F)
        self.log["t"].append(context.get_time())
        self.log["p"].append(x.p[0] - x.R[0] @ self.model.p_LLcm)
        self.log["v"].append(x.v[0])
        self.log["R"].append(x.R[0])
        self.log["x"].append(x)
        self.x = integrate(self.model, x, F, h)
        discrete.get_mutable_vector(0).SetFromVector([context.get_time()])

    def _payload_state(self, context, output):
        x = self.x
        R, omega = x.R[0], x.R[0] @ x.W[0]
        c = R @ self.model.p_LLcm
        q = quat_from_matrix(R)
        output.SetFromVector(np.concatenate([q, x.p[0] - c, omega, x.v[0] - np.cross(omega, c)]))

    def _quadrotor_states(self, context, output):
        x, model = self.x, self.model
        omega = x.R[0] @ x.W[0]
        arms = model.arms @ x.R[0].T
        l = model.cable_length[:, None]
        p = x.p[0] + arms - l * x.xi[0]
        v = x.v[0] + np.cross(omega, arms) - l * cross(x.w[0], x.xi[0])
        rate = (self.R_WQ @ self.W_Q[:, :, None])[:, :, 0]
        output.SetFromVector(np.hstack([quat_from_matrix(self.R_WQ), p, rate, v]).ravel())

    def _cable_directions(self, context, output):
        x = self.x
        output.SetFromVector(np.hstack([x.xi[0], cross(x.w[0], x.xi[0])]).ravel())


class Sensor(LeafSystem):
    """Samples at 50 Hz and adds noise to the payload's position."""

    def __init__(self, n, noise, seed, period=0.02):
        super().__init__()
        self.noise, self.rng = noise, np.random.default_rng(seed)
        for name, size in (
            ("payload_state", 13),
            ("quadrotor_states", 13 * n),
            ("cable_directions", 6 * n),
        ):
            self.DeclareVectorInputPort(name, size)
            index = self.DeclareDiscreteState(size)
            self.DeclareStateOutputPort(name, index)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)

    def _sample(self, context, discrete):
        for k in range(3):
            value = self.get_input_port(k).Eval(context).copy()
            if k == 0:
                value[4:7] += self.noise * self.rng.standard_normal(3)
            discrete.get_mutable_vector(k).SetFromVector(value)


def hanging(model, p_L, R=None):
    """The model's state at rest with the tracked point at p_L; R defaults to upright."""
    R = np.eye(3) if R is None else R
    n = model.n
    xi = np.tile([0.0, 0.0, -1.0], (1, n, 1))
    return PayloadState(
        (np.asarray(p_L) + R @ model.p_LLcm)[None],
        np.zeros((1, 3)),
        R[None].copy(),
        np.zeros((1, 3)),
        xi,
        np.zeros((1, n, 3)),
        np.zeros((1, n, 3)),
    )


def fly(
    controller,
    truth,
    x,
    reference,
    seconds,
    noise=0.0,
    seed=0,
    propellers=None,
    sensor_period=0.02,
    step=0.004,
    hold=None,
):
    """Simulate; return the log as arrays, with the reference's position beside the payload's.

    Without a `sensor_period` the controller reads the exact state. The attitude loop's commands are
    new at every step, or held for the time `hold`.
    """
    n = truth.n
    propellers = propellers or [CROSS] * n
    builder = DiagramBuilder()
    plant = builder.AddSystem(LightPlant(truth, x, propellers, step))
    sensor = (
        None if sensor_period is None else builder.AddSystem(Sensor(n, noise, seed, sensor_period))
    )
    controller = builder.AddSystem(controller)
    attitude = builder.AddSystem(AttitudeController(propellers, QUADROTOR_INERTIA))
    source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(reference)))
    for name in ("payload_state", "quadrotor_states", "cable_directions"):
        seen = plant
        if sensor is not None:
            builder.Connect(plant.GetOutputPort(name), sensor.GetInputPort(name))
            seen = sensor
        builder.Connect(seen.GetOutputPort(name), controller.GetInputPort(name))
    builder.Connect(source.get_output_port(), controller.GetInputPort("reference"))
    builder.Connect(
        plant.GetOutputPort("quadrotor_states"), attitude.GetInputPort("quadrotor_states")
    )
    builder.Connect(
        controller.GetOutputPort("thrust_vectors"), attitude.GetInputPort("thrust_vectors")
    )
    commands = attitude.GetOutputPort("propeller_commands")
    if hold is not None:
        # One step after the control step at 0.
        held = builder.AddSystem(ZeroOrderHold(hold, 4 * n, step))
        builder.Connect(commands, held.get_input_port())
        commands = held.get_output_port()
    builder.Connect(commands, plant.GetInputPort("commands"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(seconds)
    log = {key: np.array(plant.log[key]) for key in ("t", "p", "v", "R")}
    log["x"] = plant.log["x"]
    log["reference"] = reference.sample(log["t"]).p
    log["error"] = np.linalg.norm(log["p"] - log["reference"], axis=1)
    return log
