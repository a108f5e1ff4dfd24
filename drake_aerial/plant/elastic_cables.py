"""Elastic cables as a system: spring and damper forces, and the release of overloaded grippers."""

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
    ValueProducer,
)

from drake_aerial.geometry import Array
from drake_aerial.plant.cable import Cable
from drake_aerial.plant.cable_geometry import contact_offsets
from drake_aerial.plant.cable_tensions import HoldingForces
from drake_aerial.plant.elastic_step import mean_pull, tension_matrix


class ElasticCables(LeafSystem):
    """Forces of n elastic cables, and the release of their grippers.

    A cable's tension is T = max(0, k (d - l) + c d') for a distance d above its length l, else 0,
    as the mean over the plant's step (`mean_pull`). A gripper whose pull along the normal,
    T (-xi.normal), exceeds its holding force is released; its cable has T = 0 from then on.

    | port | size | meaning |
    |---|---|---|
    | in `payload_state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | out `applied_spatial_force` | abstract | spatial forces for the plant |
    | out `tension` | n | [N] |
    | out `attached` | n | 1 attached, 0 released (the discrete state) |

    `mean_pull` needs the accelerations of the stretches without the cables (thrust, weight,
    rotation). They are estimated as the last step's change of rate less the part of its tensions.
    """

    def __init__(self, plant: MultibodyPlant, cables: list[Cable]):
        super().__init__()
        n = len(cables)
        self._p_LC = np.stack([cable.gripper.p_LC for cable in cables])
        self._holding = HoldingForces(cables)
        self._length = np.array([cable.parameters.length for cable in cables])
        self._k = np.array([cable.parameters.stiffness for cable in cables])
        self._c = np.array([cable.parameters.damping for cable in cables])
        self._payload = cables[0].gripper.payload.body.index()
        self._quadrotors = [cable.quadrotor.body.index() for cable in cables]
        self._payload_state = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotor_states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._step = plant.time_step()
        self._masses = np.array([cable.quadrotor.body.default_mass() for cable in cables])
        self._mass, self._p_LoC, self._inertia = _suspended(plant, cables)
        state = self.DeclareDiscreteState(np.ones(n))
        # Data of the last step: time, rates of the stretches, and their accelerations from T.
        self._last = self.DeclareDiscreteState(np.concatenate([[-np.inf], np.zeros(2 * n)]))
        sources = {
            self._payload_state.ticket(),
            self._quadrotor_states.ticket(),
            self.xd_ticket(),
            self.time_ticket(),
        }
        # Forces, tensions and release share one evaluation.
        producer = ValueProducer(allocate=lambda: Value[object](), calc=self._calc_pull)
        self._pull = self.DeclareCacheEntry("pull", producer, sources)
        model = plant.AllocateInputAbstract(plant.get_applied_spatial_force_input_port())
        self.DeclareAbstractOutputPort(
            "applied_spatial_force", model.Clone, self._calc_forces, sources
        )
        self.DeclareVectorOutputPort("tension", n, self._calc_tension, sources)
        self.DeclareStateOutputPort("attached", state)
        self.DeclarePeriodicDiscreteUpdateEvent(self._step, 0.0, self._advance)

    def _calc_pull(self, context: Context, value: AbstractValue) -> None:
        attached = context.get_discrete_state(0).value()
        offsets = contact_offsets(
            self._payload_state.Eval(context), self._quadrotor_states.Eval(context), self._p_LC
        )
        distance = np.sqrt(np.einsum("ij,ij->i", offsets.p_QC_W, offsets.p_QC_W))
        xi = offsets.p_QC_W / np.maximum(distance, 1e-9)[:, None]
        stretch = distance - self._length
        rate = np.einsum("ij,ij->i", xi, offsets.v_QC_W)
        if (stretch < -self._step * np.abs(rate) - 1e-3).all():
            still = np.zeros(len(stretch))
            value.set_value((still, xi, offsets.R_WL, rate, still))
            return
        matrix = tension_matrix(
            self._masses, self._mass, self._inertia, self._p_LoC, xi @ offsets.R_WL
        )
        matrix = matrix * attached
        last = context.get_discrete_state(self._last).value()
        other = np.zeros(len(stretch))
        # If the time was set by hand, there is no previous step.
        if 0.0 < context.get_time() - last[0] < 1.5 * self._step:
            before, by_tension = last[1:].reshape(2, -1)
            other = (rate - before) / self._step - by_tension
        tension = mean_pull(stretch, rate, other, matrix, self._k, self._c, self._step) * attached
        value.set_value((tension, xi, offsets.R_WL, rate, -matrix @ tension))

    def _calc_tension(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._pull.Eval(context)[0])

    def _calc_forces(self, context: Context, value: AbstractValue) -> None:
        tension, xi, *_ = self._pull.Eval(context)
        forces = []
        for i, T in enumerate(tension):
            if T == 0.0:
                continue
            at_quadrotor, at_contact = (
                ExternallyAppliedSpatialForce(),
                ExternallyAppliedSpatialForce(),
            )
            at_quadrotor.body_index = self._quadrotors[i]
            at_quadrotor.F_Bq_W = SpatialForce(np.zeros(3), T * xi[i])
            at_contact.body_index = self._payload
            at_contact.p_BoBq_B = self._p_LC[i]
            at_contact.F_Bq_W = SpatialForce(np.zeros(3), -T * xi[i])
            forces += [at_quadrotor, at_contact]
        value.set_value(forces)

    def _advance(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        tension, xi, R_WL, rate, by_tension = self._pull.Eval(context)
        discrete_state.get_mutable_vector(self._last).SetFromVector(
            np.concatenate([[context.get_time()], rate, by_tension])
        )
        overloaded = self._holding.exceeded(tension, xi, R_WL)
        if overloaded.any():
            attached = context.get_discrete_state(0).value() * ~overloaded
            discrete_state.get_mutable_vector(0).SetFromVector(attached)
        return EventStatus.Succeeded()


def _suspended(plant: MultibodyPlant, cables: list[Cable]) -> tuple[float, Array, Array]:
    """Return mass, contacts and inertia of the payload with its grippers, in L.

    Returns
    -------
    mass : float [kg]
    p_LoC : (n, 3) array
        Contacts from the centre of mass [m].
    inertia : (3, 3) array
        About the centre of mass [kg m^2].
    """
    payload = cables[0].gripper.payload.body
    bodies = [payload.index(), *(cable.gripper.body.index() for cable in cables)]
    context = plant.CreateDefaultContext()
    if payload.is_floating_base_body():
        # At the world's origin, where the sums have no round-off from the payload's height.
        plant.SetFreeBodyPose(context, payload, RigidTransform())
    M_L = plant.CalcSpatialInertia(context, payload.body_frame(), bodies)
    com = np.array(M_L.get_com())
    central = M_L.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    return M_L.get_mass(), np.stack([cable.gripper.p_LC for cable in cables]) - com, central
