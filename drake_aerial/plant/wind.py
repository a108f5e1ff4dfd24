"""Wind: the velocity of the air, and its drag on payload and quadrotors."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.records import NonNegative, Positive, Vector, record
from drake_aerial.plant.cable_geometry import rotation
from drake_aerial.plant.dryden import Dryden
from drake_aerial.plant.part_checks import check_list, check_plant, check_type
from drake_aerial.plant.payload_body import PayloadBody
from drake_aerial.plant.quadrotor import Quadrotor

AIR_DENSITY = 1.225
"""At sea level [kg/m^3]."""
TURBULENCE_PERIOD = 0.002
"""Default time step of the turbulence, which is constant in between [s]."""


@record(frozen=True)
class WindParameters:
    """Mean wind plus a gust plus turbulence; with zeros, only the drag in still air remains.

    Vectors are in the world frame. The wind is the same everywhere, and acts on the payload and on
    the quadrotors. Not modelled: the quadrotors' downwash on the payload and on one another, the
    drag of cables and grippers, lift and aerodynamic moments, the effect of inflow on the
    propellers' thrust, and the change of turbulence with place or height.

    Examples
    --------
    >>> from drake_aerial import StationParameters, WindParameters
    >>> breeze = WindParameters(mean=(3.0, 0.0, 0.0), gust=(0.0, 2.0, 0.0), gust_start=8.0)
    >>> StationParameters(wind=breeze).wind.mean
    (3.0, 0.0, 0.0)
    """

    mean: Vector = (0.0, 0.0, 0.0)
    """Mean velocity of the air [m/s]."""
    gust: Vector = (0.0, 0.0, 0.0)
    """Peak velocity of a gust of the "1 - cosine" shape [m/s]."""
    gust_start: NonNegative = 5.0
    """Time at which the gust begins [s]."""
    gust_duration: Positive = 2.0
    """Duration of the gust [s]."""
    turbulence: Dryden | None = None
    """Dryden turbulence along the mean wind's horizontal heading (the world's x if it has none),
    across it and up; None for none."""
    payload_drag: NonNegative = 1.05
    """Drag coefficient of the payload, for the areas of its bounding box's faces; 1.05 is that of a
    cube (dimensionless)."""
    quadrotor_drag_area: NonNegative = 0.01
    """Drag coefficient times area of each quadrotor, the same in all directions [m^2]."""


class Wind(LeafSystem):
    """Velocity of the air, the same everywhere.

    | port | size | meaning |
    |---|---|---|
    | out `velocity` | 3 | velocity of the air in the world [m/s] |

    Turbulence is noise filtered by Dryden's filters, discretised exactly and stationary from the
    first step on. The filters' state is in the Context. The noise is a function of time and of the
    seed, a parameter in the Context (`set_seed`).

    Parameters
    ----------
    parameters : WindParameters
    period : float
        Time step of the turbulence [s]: that of the plant.

    Raises
    ------
    InputError
        If the period is not positive.
    """

    def __init__(self, parameters: WindParameters, period: float = TURBULENCE_PERIOD):
        super().__init__()
        if not (np.isfinite(period) and period > 0.0):
            raise InputError(f"`period` of the turbulence must be positive [s], got {period!r}")
        self._parameters, self._period = parameters, period
        self._mean, self._gust = np.array(parameters.mean), np.array(parameters.gust)
        self._seed = self.DeclareNumericParameter(BasicVector([0.0]))
        self.DeclareDiscreteState(np.zeros(6))
        if parameters.turbulence is not None:
            self._Phi, self._N, C, self._N0 = parameters.turbulence.steps(period)
            heading = np.arctan2(self._mean[1], self._mean[0])
            along, across = (
                (np.cos(heading), np.sin(heading), 0.0),
                (-np.sin(heading), np.cos(heading), 0.0),
            )
            self._C_W = np.array([along, across, (0.0, 0.0, 1.0)]).T[:, :, None] * C
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._stir)
        self.DeclareVectorOutputPort("velocity", 3, self._calc)

    def set_seed(self, context: Context, seed: int) -> None:
        """Set the random seed of the turbulence in this system's context."""
        context.get_mutable_numeric_parameter(self._seed).SetFromVector([float(seed)])

    def _stir(self, context: Context, discrete_state: DiscreteValues) -> None:
        number = round(context.get_time() / self._period)
        seed = int(context.get_numeric_parameter(self._seed).GetAtIndex(0))
        # The second word of the key separates this stream from that of the sensor's noise.
        key, counter = np.array([seed, 1], dtype=np.uint64), [0, 0, 0, number]
        noise = np.random.Generator(np.random.Philox(key=key, counter=counter)).standard_normal(
            (3, 2, 1)
        )
        if number > 0:
            after = (
                self._Phi @ context.get_discrete_state_vector().value().reshape(3, 2, 1)
                + self._N @ noise
            )
        else:
            after = self._N0 @ noise
        discrete_state.get_mutable_vector().SetFromVector(after.ravel())

    def _calc(self, context: Context, output: BasicVector) -> None:
        p = self._parameters
        since = (context.get_time() - p.gust_start) / p.gust_duration
        strength = 0.5 * (1.0 - np.cos(2.0 * np.pi * since)) if 0.0 < since < 1.0 else 0.0
        velocity = self._mean + strength * self._gust
        if p.turbulence is not None:
            x = context.get_discrete_state_vector().value().reshape(3, 2)
            velocity = velocity + (self._C_W * x).sum((1, 2))
        output.SetFromVector(velocity)


class WindDrag(LeafSystem):
    """Drag of the air on a payload and n quadrotors.

    The force on the payload acts at the centre of its bounding box. In the axes of L it is
    f = rho/2 c |v| (A_x v_x, A_y v_y, A_z v_z) [N], with the air's velocity v relative to that
    point [m/s] and the areas A of the box's faces [m^2]. The force on a quadrotor acts at its
    centre: rho/2 (c A) |v| v. There are no moments about these points. `WindParameters` says what
    is not modelled.

    | port | size | meaning |
    |---|---|---|
    | in `wind` | 3 | velocity of the air in the world [m/s] |
    | in `payload_state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | out `applied_spatial_force` | abstract | spatial forces for the plant |

    Parameters
    ----------
    plant : MultibodyPlant
        Finalized.
    payload : PayloadBody
    quadrotors : list of Quadrotor
    parameters : WindParameters
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        payload: PayloadBody,
        quadrotors: list[Quadrotor],
        parameters: WindParameters,
    ):
        super().__init__()
        n = len(quadrotors)
        low, high = payload.payload.vertices.min(axis=0), payload.payload.vertices.max(axis=0)
        x, y, z = high - low
        self._centre = 0.5 * (low + high)
        self._on_payload = (
            0.5 * AIR_DENSITY * parameters.payload_drag * np.array([y * z, z * x, x * y])
        )
        self._on_quadrotor = 0.5 * AIR_DENSITY * parameters.quadrotor_drag_area
        self._payload, self._quadrotors = payload.body.index(), [q.body.index() for q in quadrotors]
        self._wind = self.DeclareVectorInputPort("wind", 3)
        self._payload_state = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotor_states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        model = plant.AllocateInputAbstract(plant.get_applied_spatial_force_input_port())
        self.DeclareAbstractOutputPort("applied_spatial_force", model.Clone, self._calc)

    def _calc(self, context: Context, value: AbstractValue) -> None:
        wind, payload = self._wind.Eval(context), self._payload_state.Eval(context)
        R = rotation(payload[:4])
        v_L = R.T @ (wind - payload[10:13] - np.cross(payload[7:10], R @ self._centre))
        forces = [
            _push(self._payload, self._centre, R @ (np.sqrt(v_L @ v_L) * self._on_payload * v_L))
        ]
        for body, state in zip(
            self._quadrotors, self._quadrotor_states.Eval(context).reshape(-1, 13), strict=True
        ):
            v = wind - state[10:13]
            forces.append(_push(body, np.zeros(3), self._on_quadrotor * np.sqrt(v @ v) * v))
        value.set_value(forces)


def _push(body: int, p_BoBq_B: Array, f_W: Array) -> ExternallyAppliedSpatialForce:
    force = ExternallyAppliedSpatialForce()
    force.body_index = body
    force.p_BoBq_B = p_BoBq_B
    force.F_Bq_W = SpatialForce(np.zeros(3), f_W)
    return force


def connect_wind(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    payload: PayloadBody,
    quadrotors: list[Quadrotor],
    payload_state: OutputPort,
    quadrotor_states: OutputPort,
    parameters: WindParameters,
    name: str = "wind",
) -> tuple[Wind, OutputPort]:
    """Add wind and its drag to a diagram; turbulence has the time step of the plant.

    Parameters
    ----------
    builder : DiagramBuilder
    plant : MultibodyPlant
        Finalized.
    payload : PayloadBody
        The payload, as `add_payload` returns it.
    quadrotors : list of Quadrotor
        The n quadrotors, as `add_quadrotor` returns them.
    payload_state, quadrotor_states : OutputPort
        State of L (13) and of the quadrotors (13 n), from the plant.
    parameters : WindParameters
    name : str
        Name of the system of the velocity; that of the drag is "<name>_drag".

    Returns
    -------
    wind : Wind
    forces : OutputPort
        Spatial forces, for the plant's applied_spatial_force port.

    Raises
    ------
    InputError
        If an argument has the wrong type, or if the plant is not finalized.
    """
    check_plant(plant, finalized=True)
    check_type("payload", payload, PayloadBody, "as add_payload returns it")
    check_list("quadrotors", quadrotors, Quadrotor, "as add_quadrotor returns it")
    check_type("parameters", parameters, WindParameters)
    wind = builder.AddNamedSystem(name, Wind(parameters, plant.time_step() or TURBULENCE_PERIOD))
    drag = builder.AddNamedSystem(f"{name}_drag", WindDrag(plant, payload, quadrotors, parameters))
    builder.Connect(wind.get_output_port(), drag.GetInputPort("wind"))
    builder.Connect(payload_state, drag.GetInputPort("payload_state"))
    builder.Connect(quadrotor_states, drag.GetInputPort("quadrotor_states"))
    return wind, drag.get_output_port()
