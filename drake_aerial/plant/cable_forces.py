"""The cables of one payload in a diagram: their system, its ports and the release of grippers."""

from dataclasses import dataclass

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    OutputPort,
)

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.plant.cable import Cable
from drake_aerial.plant.cable_tensions import CableTensions
from drake_aerial.plant.elastic_cables import ElasticCables
from drake_aerial.plant.part_checks import check_list, check_plant

_NOTHING_DONE = EventStatus.DidNothing()


class GripperRelease:
    """Release overloaded grippers between two steps; a monitor for `Simulator.set_monitor`.

    The status of a constraint is a parameter of the plant's context, which no event of a system
    can write. `CableSystem.install` sets this monitor.

    Parameters
    ----------
    plant : MultibodyPlant
    cables : list of Cable
        n inextensible cables.
    tensions : CableTensions
        The system of their tensions, in a diagram that holds `plant`.
    """

    def __init__(self, plant: MultibodyPlant, cables: list[Cable], tensions: CableTensions):
        self._plant, self._cables, self._tensions = plant, cables, tensions

    @property
    def is_needed(self) -> bool:
        """True if a gripper has a finite holding force."""
        return self._tensions.can_release

    def let_go(self, root_context: Context, i: int) -> None:
        """Release gripper i between two steps, in the context of the whole diagram."""
        context = self._plant.GetMyMutableContextFromRoot(root_context)
        self._plant.SetConstraintActiveStatus(context, self._cables[i].grip, False)
        self._tensions.release(self._tensions.GetMyMutableContextFromRoot(root_context), i)

    def __call__(self, root_context: Context) -> EventStatus:
        """Release the overloaded grippers in the context of the whole diagram."""
        overloaded = self._tensions.overloaded(self._tensions.GetMyContextFromRoot(root_context))
        for i in overloaded:
            self.let_go(root_context, i)
        return EventStatus.Succeeded() if overloaded else _NOTHING_DONE


@dataclass(frozen=True, eq=False)
class CableSystem:
    """Tensions, forces and gripper release of n cables of one kind, made by `connect_cables`.

    Attributes
    ----------
    system : LeafSystem
        `CableTensions` or `ElasticCables`.
    tension : OutputPort
        (n) [N]
    forces : OutputPort or None
        Spatial forces for the plant's applied_spatial_force port; None for inextensible cables.
    attached_port : OutputPort
        (n), 1 where a gripper holds, 0 where it was released.
    release : GripperRelease or None
        The monitor that releases overloaded grippers; None for elastic cables, which need none.
    """

    system: LeafSystem
    tension: OutputPort
    forces: OutputPort | None
    attached_port: OutputPort
    release: GripperRelease | None

    def install(self, simulator: Simulator) -> None:
        """Install the release of overloaded grippers in a simulation, for either kind of cable.

        Inextensible cables need a monitor for it. The simulator's present monitor is called after
        it. Call this after `simulator.set_monitor`, which would replace the monitor, and before
        `simulator.Initialize`. Elastic cables need no monitor, and nothing is done for them.

        Parameters
        ----------
        simulator : Simulator
            Simulator of the diagram that holds the cables.
        """
        if self.release is None or not self.release.is_needed:
            return
        release, present = self.release, simulator.get_monitor()

        def release_then_monitor(root_context: Context) -> EventStatus:
            release(root_context)
            return present(root_context)

        simulator.set_monitor(release if present is None else release_then_monitor)

    def let_go(self, root_context: Context, i: int) -> None:
        """Release gripper i between two steps, in the context of the whole diagram."""
        if self.release is not None:
            self.release.let_go(root_context, i)
            return
        context = self.system.GetMyMutableContextFromRoot(root_context)
        context.get_mutable_discrete_state(0).SetAtIndex(i, 0.0)

    def attached(self, root_context: Context) -> Array:
        """Return which grippers (n,) hold, as booleans, in the context of the whole diagram."""
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
    """Add the system that computes the tensions of n cables and applies elastic forces.

    A gripper on an elastic cable is released automatically if its holding force is exceeded.
    On an inextensible one it does so only after `CableSystem.install(simulator)`; without it a
    RuntimeWarning says that the gripper stays attached.

    Parameters
    ----------
    builder : DiagramBuilder
    plant : MultibodyPlant
        Finalized.
    cables : list of Cable
        n cables of one kind on one payload, as `add_cable` returns them.
    payload_state, quadrotor_states : OutputPort
        State of L (13) and of the cables' quadrotors (13 n), in the cables' order, from the plant.
    name : str
        Name of the system.

    Raises
    ------
    InputError
        If the cables are of both kinds or on several payloads, if an argument has the wrong type,
        or if the plant is not finalized.

    Examples
    --------
    >>> from pydrake.systems.framework import DiagramBuilder
    >>> from drake_aerial import Payload, add_cable, add_gripper, add_payload, add_plant
    >>> from drake_aerial import add_quadrotor, connect_cables
    >>> builder = DiagramBuilder()
    >>> plant, _ = add_plant(builder)
    >>> box = add_payload(plant, Payload.from_box([0.4, 0.4, 0.2], mass=0.25))
    >>> quadrotor = add_quadrotor(plant)
    >>> cable = add_cable(plant, quadrotor, add_gripper(plant, box, [0.0, 0.0, 0.1]))
    >>> plant.Finalize()
    >>> state = plant.get_state_output_port
    >>> states = state(box.model_instance), state(quadrotor.model_instance)
    >>> connect_cables(builder, plant, [cable], *states).tension.size()
    1
    """
    check_plant(plant, finalized=True)
    check_list("cables", cables, Cable, "as add_cable returns it")
    kinds = sorted({cable.parameters.kind for cable in cables})
    if len(kinds) != 1:
        raise InputError(f"`cables` must be of one kind, got {' and '.join(kinds)}")
    if any(cable.gripper.payload is not cables[0].gripper.payload for cable in cables):
        raise InputError("`cables` must be on one payload: call connect_cables once per payload")
    inextensible = kinds[0] == "inextensible"
    system = builder.AddNamedSystem(
        name, CableTensions(plant, cables) if inextensible else ElasticCables(plant, cables)
    )
    builder.Connect(payload_state, system.GetInputPort("payload_state"))
    builder.Connect(quadrotor_states, system.GetInputPort("quadrotor_states"))
    tension, attached = system.GetOutputPort("tension"), system.GetOutputPort("attached")
    if not inextensible:
        forces = system.GetOutputPort("applied_spatial_force")
        return CableSystem(system, tension, forces, attached, None)
    reaction_forces = plant.get_reaction_forces_output_port()
    builder.Connect(reaction_forces, system.GetInputPort("reaction_forces"))
    for i, cable in enumerate(cables):
        slide = plant.get_state_output_port(cable.gripper.model_instance)
        builder.Connect(slide, system.GetInputPort(f"slide_{i}"))
    return CableSystem(system, tension, None, attached, GripperRelease(plant, cables, system))
