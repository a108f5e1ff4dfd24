"""One control step of a controller, outside of any diagram."""

import numpy as np
from pydrake.common.value import AbstractValue

from drake_aerial.geometry import cross, quat_from_matrix, quat_from_two_vectors


def port_values(model, x, axes=None):
    """The controller's three input vectors for model state x (batch of 1).

    The quadrotors are upright, or have the thrust axes (n, 3).
    """
    R, omega = x.R[0], x.R[0] @ x.W[0]
    c = R @ model.p_LLcm
    payload = np.concatenate([quat_from_matrix(R), x.p[0] - c, omega, x.v[0] - np.cross(omega, c)])
    arms = model.arms @ R.T
    l = model.cable_length[:, None]
    quadrotors = np.zeros((model.n, 13))
    quadrotors[:, 0] = 1.0
    if axes is not None:
        quadrotors[:, 0:4] = quat_from_two_vectors(np.array([[0.0, 0.0, 1.0]]), axes)
    quadrotors[:, 4:7] = x.p[0] + arms - l * x.xi[0]
    quadrotors[:, 10:13] = x.v[0] + np.cross(omega, arms) - l * cross(x.w[0], x.xi[0])
    return payload, quadrotors.ravel(), np.hstack([x.xi[0], cross(x.w[0], x.xi[0])]).ravel()


def fix_inputs(controller, context, model, x, reference, axes=None):
    for name, value in zip(
        ("payload_state", "quadrotor_states", "cable_directions"),
        port_values(model, x, axes),
        strict=True,
    ):
        controller.GetInputPort(name).FixValue(context, value)
    controller.GetInputPort("reference").FixValue(context, AbstractValue.Make(reference))


def control_step(controller, context):
    """Advance the context by one control step; return the thrusts (n, 3)."""
    context.SetDiscreteState(controller.EvalUniquePeriodicDiscreteUpdate(context))
    return controller.GetOutputPort("thrust_vectors").Eval(context).reshape(-1, 3)


def first_command(controller, model, x, reference, time=0.0):
    context = controller.CreateDefaultContext()
    context.SetTime(time)
    fix_inputs(controller, context, model, x, reference)
    return control_step(controller, context)
