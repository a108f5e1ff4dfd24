"""Forces of the air on payload and quadrotors in a plant: drag and buoyancy."""

from math import sqrt

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem, OutputPort

from drake_aerial.plant.air import AirParameters, payload_air
from drake_aerial.plant.part_checks import check_list, check_plant, check_type
from drake_aerial.plant.payload_body import PayloadBody
from drake_aerial.plant.quadrotor import Quadrotor
from drake_aerial.plant.wind import TURBULENCE_PERIOD, Wind, WindParameters
from drake_aerial.statics.gravity import GRAVITY


class AirDrag(LeafSystem):
    """Forces of the air on a payload and n quadrotors.

    The payload's drag |v| K v acts at its centre of drag (`plant.air.payload_air`), with the
    velocity of the air relative to that point. The buoyancy that balances the weight of the air
    that moves along acts there too. Rotor drag acts at the centre of each quadrotor, across its
    thrust. `AirParameters` says what is not modelled.

    | port | size | meaning |
    |---|---|---|
    | in `wind` | 3 | velocity of the air in the world [m/s]; optional (0) |
    | in `payload_state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | out `applied_generalized_force` | - | generalized forces for the plant [N, N m] |

    Parameters
    ----------
    plant : MultibodyPlant
        Finalized. Payload and quadrotors are free bodies in it.
    payload : PayloadBody
    quadrotors : list of Quadrotor
    parameters : AirParameters
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        payload: PayloadBody,
        quadrotors: list[Quadrotor],
        parameters: AirParameters,
    ):
        super().__init__()
        n = len(quadrotors)
        own = payload.payload
        air = payload.air or payload_air(own.vertices, own.faces, parameters)
        self._drag, self._centre = air.drag.tolist(), air.centre.tolist()
        self._buoyancy = 0.0 if payload.air is None else GRAVITY * air.mass
        self._rotor_drag = [parameters.rotor_drag * q.parameters.mass for q in quadrotors]
        # Generalized forces of a free body are its moment and force in the world.
        self._size = plant.num_velocities()
        self._payload = payload.body.floating_velocities_start_in_v()
        self._quadrotors = [q.body.floating_velocities_start_in_v() for q in quadrotors]
        self._wind = self.DeclareVectorInputPort("wind", 3)
        self._payload_state = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotor_states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        inputs = {port.ticket() for port in (self._wind, self._payload_state)}
        inputs.add(self._quadrotor_states.ticket())
        name = "applied_generalized_force"
        self.DeclareVectorOutputPort(name, self._size, self._calc, inputs)

    def _calc(self, context: Context, output: BasicVector) -> None:
        wind = _STILL
        if self._wind.HasValue(context):
            wind = self._wind.Eval(context).tolist()
        forces, k = [0.0] * self._size, self._payload
        forces[k : k + 6] = self._on_payload(self._payload_state.Eval(context).tolist(), wind)
        states, first = self._quadrotor_states.Eval(context).tolist(), 0
        for k, c in zip(self._quadrotors, self._rotor_drag, strict=True):
            forces[k + 3 : k + 6] = _rotor_drag(c, states[first : first + 13], wind)
            first += 13
        output.SetFromVector(forces)

    def _on_payload(self, state: list[float], wind: list[float]) -> list[float]:
        """Return moment about L's origin [N m] and force [N] of drag and buoyancy, in the world."""
        # Plain floats: for few bodies they are several times faster than small arrays.
        w, x, y, z, _, _, _, p, q, r, vx, vy, vz = state
        xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
        wx, wy, wz = w * x, w * y, w * z
        R = (
            (1.0 - 2.0 * (yy + zz), 2.0 * (xy - wz), 2.0 * (xz + wy)),
            (2.0 * (xy + wz), 1.0 - 2.0 * (xx + zz), 2.0 * (yz - wx)),
            (2.0 * (xz - wy), 2.0 * (yz + wx), 1.0 - 2.0 * (xx + yy)),
        )
        a, b, c = self._centre
        cx, cy, cz = (row[0] * a + row[1] * b + row[2] * c for row in R)
        u = (
            wind[0] - vx - (q * cz - r * cy),
            wind[1] - vy - (r * cx - p * cz),
            wind[2] - vz - (p * cy - q * cx),
        )
        u0, u1, u2 = (R[0][i] * u[0] + R[1][i] * u[1] + R[2][i] * u[2] for i in range(3))
        speed = sqrt(u0 * u0 + u1 * u1 + u2 * u2)
        f = [speed * (row[0] * u0 + row[1] * u1 + row[2] * u2) for row in self._drag]
        fx, fy, fz = (row[0] * f[0] + row[1] * f[1] + row[2] * f[2] for row in R)
        fz += self._buoyancy
        return [cy * fz - cz * fy, cz * fx - cx * fz, cx * fy - cy * fx, fx, fy, fz]


_STILL = [0.0, 0.0, 0.0]


def _rotor_drag(coefficient: float, state: list[float], wind: list[float]) -> list[float]:
    """Return the rotor drag (3,) of a quadrotor in the world [N]."""
    w, x, y, z = state[0:4]
    a, b, c = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    u, v, s = wind[0] - state[10], wind[1] - state[11], wind[2] - state[12]
    along = a * u + b * v + c * s
    return [
        coefficient * (u - along * a),
        coefficient * (v - along * b),
        coefficient * (s - along * c),
    ]


def connect_air(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    payload: PayloadBody,
    quadrotors: list[Quadrotor],
    payload_state: OutputPort,
    quadrotor_states: OutputPort,
    parameters: AirParameters,
    wind: WindParameters | None = None,
) -> tuple[Wind | None, OutputPort]:
    """Add the forces of the air, and wind, to a diagram; turbulence has the plant's time step.

    The system of the forces is named "air", that of the wind "wind".

    Parameters
    ----------
    builder : DiagramBuilder
    plant : MultibodyPlant
        Finalized.
    payload : PayloadBody
        The payload, as `add_payload` returns it. If it was added without air, it has drag only.
    quadrotors : list of Quadrotor
        The n quadrotors, as `add_quadrotor` returns them.
    payload_state, quadrotor_states : OutputPort
        State of L (13) and of the quadrotors (13 n), from the plant.
    parameters : AirParameters
    wind : WindParameters, optional
        None for still air.

    Returns
    -------
    wind : Wind or None
    forces : OutputPort
        Generalized forces, for the plant's applied_generalized_force port.

    Raises
    ------
    InputError
        If an argument has the wrong type, or if the plant is not finalized.
    """
    check_plant(plant, finalized=True)
    check_type("payload", payload, PayloadBody, "as add_payload returns it")
    check_list("quadrotors", quadrotors, Quadrotor, "as add_quadrotor returns it")
    check_type("parameters", parameters, AirParameters)
    drag = builder.AddNamedSystem("air", AirDrag(plant, payload, quadrotors, parameters))
    builder.Connect(payload_state, drag.GetInputPort("payload_state"))
    builder.Connect(quadrotor_states, drag.GetInputPort("quadrotor_states"))
    if wind is None:
        return None, drag.get_output_port()
    check_type("wind", wind, WindParameters)
    velocity = builder.AddNamedSystem("wind", Wind(wind, plant.time_step() or TURBULENCE_PERIOD))
    builder.Connect(velocity.get_output_port(), drag.GetInputPort("wind"))
    return velocity, drag.get_output_port()
