"""Cable tensions as a system: read from the solver for inextensible cables, made by a spring for elastic ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    EventStatus,
    LeafSystem,
    OutputPort,
    ValueProducer,
)

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import Cable, tension_matrix
from drake_aerial.plant.cable_geometry import contact_offsets
from drake_aerial.plant.elastic_step import mean_pull
from drake_aerial.statics.gravity import GRAVITY

_NOTHING_DONE = EventStatus.DidNothing()


class CableTensions(LeafSystem):
    """Tensions of n inextensible cables, from the reaction forces of their prismatic joints.

    | port | size | meaning |
    |---|---|---|
    | in `reaction_forces` | abstract | the plant's port of that name |
    | out `tension` | n | [N]; 0 while slack |
    | out `attached` | n | 1 attached, 0 released (the discrete state, which `GripperRelease` sets) |
    """

    def __init__(self, plant: MultibodyPlant, cables: list[Cable]):
        super().__init__()
        self._joints = [int(cable.slide.index()) for cable in cables if cable.slide is not None]
        model_value = plant.get_reaction_forces_output_port().Allocate()
        self._forces = self.DeclareAbstractInputPort("reaction_forces", model_value)
        state = self.DeclareDiscreteState(np.ones(len(self._joints)))
        self.DeclareVectorOutputPort(
            "tension", len(self._joints), self._calc, {self._forces.ticket()}
        )
        self.DeclareStateOutputPort("attached", state)

    def _calc(self, context: Context, output: BasicVector) -> None:
        forces = self._forces.Eval(context)
        # The joint's axis is its frame's -z, so what holds the gripper back is along +z.
        output.SetFromVector([max(0.0, forces[j].translational()[2]) for j in self._joints])


class ElasticCables(LeafSystem):
    """n cables that are springs with damping while longer than their length, and nothing otherwise.

    T = max(0, k (d - l) + c d') if d > l, else 0, as the mean over the plant's step (`mean_pull`). A gripper that is pulled off
    (T (-xi.normal) above its holding force) has T = 0 from then on.

    | port | size | meaning |
    |---|---|---|
    | in `payload_state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | out `applied_spatial_force` | abstract | for the plant |
    | out `tension` | n | [N] |
    | out `attached` | n | 1 attached, 0 released (the discrete state) |

    What else accelerates the stretches (thrust, weight, turning) is what the last step saw beyond its tensions.
    """

    def __init__(self, plant: MultibodyPlant, cables: list[Cable]):
        super().__init__()
        n = len(cables)
        self._p_LC = np.stack([cable.gripper.p_LC for cable in cables])
        self._normal_L = np.stack([cable.gripper.normal_L for cable in cables])
        self._hold = np.array([cable.gripper.parameters.holding_force for cable in cables])
        self._length = np.array([cable.parameters.length for cable in cables])
        self._k = np.array([cable.parameters.stiffness for cable in cables])
        self._c = np.array([cable.parameters.damping for cable in cables])
        self._payload = cables[0].gripper.payload.body.index()
        self._quadrotors = [cable.quadrotor.body.index() for cable in cables]
        self._payload_state = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotor_states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._step = plant.time_step()
        self._masses = np.array([cable.quadrotor.body.default_mass() for cable in cables])
        self._mass, self._p_LoC, self._inertia = _hanging(plant, cables)
        state = self.DeclareDiscreteState(np.ones(n))
        # Of the last step: its time, the rates, and what the tensions made of them.
        self._last = self.DeclareDiscreteState(np.concatenate([[-np.inf], np.zeros(2 * n)]))
        sources = {
            self._payload_state.ticket(),
            self._quadrotor_states.ticket(),
            self.xd_ticket(),
            self.time_ticket(),
        }
        # One evaluation serves the forces, the tensions and the release.
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
        # A clock that was set anew has no last step.
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
        torn = normal_pull(tension, xi, self._normal_L @ R_WL.T) > self._hold
        if torn.any():
            attached = context.get_discrete_state(0).value() * ~torn
            discrete_state.get_mutable_vector(0).SetFromVector(attached)
        return EventStatus.Succeeded()


def _hanging(plant: MultibodyPlant, cables: list[Cable]) -> tuple[float, Array, Array]:
    """Return mass [kg], contacts from the centre of mass (n, 3) [m] and central inertia (3, 3) of the payload with its grippers, in L."""
    payload = cables[0].gripper.payload.body
    bodies = [payload.index(), *(cable.gripper.body.index() for cable in cables)]
    M_L = plant.CalcSpatialInertia(plant.CreateDefaultContext(), payload.body_frame(), bodies)
    com = np.array(M_L.get_com())
    central = M_L.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
    return M_L.get_mass(), np.stack([cable.gripper.p_LC for cable in cables]) - com, central


def normal_pull(tension: Array, xi: Array, normal: Array) -> Array:
    """Return the pulls (n,) [N] of cables along -xi (n, 3) on magnets whose outward normals are `normal` (n, 3)."""
    return tension * np.maximum(0.0, -np.einsum("ij,ij->i", xi, normal))


class GripperRelease:
    """Lets inextensible cables' overloaded grippers go: a monitor for `Simulator.set_monitor`.

    A constraint's status is part of the plant's context, and no system may write another's; so the release happens between two steps.
    It is looked for at every step, unless no gripper can let go.
    """

    def __init__(self, plant: MultibodyPlant, cables: list[Cable], tensions: OutputPort):
        """Watch `cables`, whose tensions (n) [N] are on the port `tensions`, of a diagram that holds `plant`."""
        self._plant = plant
        self._tensions = tensions
        self._cables = cables
        self._p_LC = np.stack([cable.gripper.p_LC for cable in cables])
        self._normal_L = np.stack([cable.gripper.normal_L for cable in cables])
        self._hold = np.array([cable.gripper.parameters.holding_force for cable in cables])
        # A taut cable pulls with less than 1.5 times what its quadrotor pushes and weighs, swinging included; beyond that there
        # must be an impact, of the quadrotor's mass at the cable's rate within one step.
        self._slides = []
        for cable, hold in zip(cables, self._hold, strict=True):
            quadrotor = cable.quadrotor.parameters
            steady = 1.5 * (quadrotor.thrust_limits[1] + quadrotor.mass * GRAVITY)
            if cable.slide is not None and np.isfinite(hold):
                self._slides.append(
                    (cable.slide, (hold - steady) * plant.time_step() / quadrotor.mass)
                )

    @property
    def is_needed(self) -> bool:
        """Whether any gripper can let go at all."""
        return any(cable.grip is not None for cable in self._cables) and bool(
            np.isfinite(self._hold).any()
        )

    def attached(self, root_context: Context) -> Array:
        """Return which grippers (n,) hold, as booleans, in the context of the whole diagram."""
        context = self._plant.GetMyContextFromRoot(root_context)
        return np.array(
            [
                c.grip is None or self._plant.GetConstraintActiveStatus(context, c.grip)
                for c in self._cables
            ]
        )

    def let_go(self, root_context: Context, i: int) -> None:
        """Release gripper i, between two steps, in the context of the whole diagram."""
        context = self._plant.GetMyMutableContextFromRoot(root_context)
        self._plant.SetConstraintActiveStatus(context, self._cables[i].grip, False)
        status = self._tensions.get_system().GetMyMutableContextFromRoot(root_context)
        status.get_mutable_discrete_state(0).SetAtIndex(i, 0.0)

    def __call__(self, root_context: Context) -> EventStatus:
        """Release what is overloaded in the context of the whole diagram."""
        context = self._plant.GetMyContextFromRoot(root_context)
        for slide, harmless in self._slides:
            if abs(slide.get_translation_rate(context)) >= harmless:
                break
        else:  # the tensions are slow to read, so most steps end here
            return _NOTHING_DONE
        system = self._tensions.get_system()
        tension = self._tensions.Eval(system.GetMyContextFromRoot(root_context))
        if not (tension > self._hold).any():
            return EventStatus.DidNothing()
        plant = self._plant
        context = plant.GetMyMutableContextFromRoot(root_context)
        X_WL = plant.EvalBodyPoseInWorld(context, self._cables[0].gripper.payload.body)
        released = False
        for i, cable in enumerate(self._cables):
            p_WQ = plant.EvalBodyPoseInWorld(context, cable.quadrotor.body).translation()
            p_QC = X_WL @ self._p_LC[i] - p_WQ
            normal = X_WL.rotation() @ self._normal_L[i]
            pull = (
                tension[i]
                * max(0.0, -float(p_QC @ normal))
                / max(float(np.linalg.norm(p_QC)), 1e-9)
            )
            if pull > self._hold[i] and plant.GetConstraintActiveStatus(context, cable.grip):
                self.let_go(root_context, i)
                released = True
        return EventStatus.Succeeded() if released else EventStatus.DidNothing()


@dataclass(frozen=True, eq=False)
class CableSystem:
    """What `connect_cables` added for n cables of one kind.

    Attributes
    ----------
    system : LeafSystem
        `CableTensions` or `ElasticCables`.
    tension : OutputPort
        (n) [N]
    forces : OutputPort or None
        Spatial forces for the plant's applied_spatial_force port (elastic kind).
    attached_port : OutputPort
        (n), 1 where a gripper holds, 0 where it let go.
    release : GripperRelease or None
        The monitor that lets overloaded grippers go (inextensible kind).
    """

    system: LeafSystem
    tension: OutputPort
    forces: OutputPort | None
    attached_port: OutputPort
    release: GripperRelease | None

    def let_go(self, root_context: Context, i: int) -> None:
        """Release gripper i, between two steps, in the context of the whole diagram."""
        if self.release is not None:
            self.release.let_go(root_context, i)
            return
        context = self.system.GetMyMutableContextFromRoot(root_context)
        context.get_mutable_discrete_state(0).SetAtIndex(i, 0.0)

    def attached(self, root_context: Context) -> Array:
        """Return which grippers (n,) hold, as booleans, in the context of the whole diagram."""
        if self.release is not None:
            return self.release.attached(root_context)
        context = self.system.GetMyContextFromRoot(root_context)
        return context.get_discrete_state(0).value() > 0.5


def connect_cables(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    cables: list[Cable],
    payload_state: OutputPort,
    quadrotor_states: OutputPort,
    name: str = "cables",
) -> CableSystem:
    """Add the system that gives the cables' tensions, to a diagram whose plant is finalized.

    Parameters
    ----------
    builder : DiagramBuilder
    plant : MultibodyPlant
    cables : list of Cable
        n of them, of one kind, on one payload.
    payload_state, quadrotor_states : OutputPort
        (13) and (13 n), true and current.
    name : str
        Of the system.

    Raises
    ------
    InputError
        If the cables are of both kinds.
    """
    kinds = sorted({cable.parameters.kind for cable in cables})
    if len(kinds) != 1:
        raise InputError(
            f"cables of the kinds {', '.join(kinds)} on one payload; one or more of a single kind accepted"
        )
    if kinds[0] == "inextensible":
        tensions = builder.AddNamedSystem(name, CableTensions(plant, cables))
        builder.Connect(plant.get_reaction_forces_output_port(), tensions.get_input_port())
        port = tensions.GetOutputPort("tension")
        release = GripperRelease(plant, cables, port)
        return CableSystem(tensions, port, None, tensions.GetOutputPort("attached"), release)
    elastic = builder.AddNamedSystem(name, ElasticCables(plant, cables))
    builder.Connect(payload_state, elastic.GetInputPort("payload_state"))
    builder.Connect(quadrotor_states, elastic.GetInputPort("quadrotor_states"))
    tension, force, attached = (
        elastic.GetOutputPort(k) for k in ("tension", "applied_spatial_force", "attached")
    )
    return CableSystem(elastic, tension, force, attached, None)
