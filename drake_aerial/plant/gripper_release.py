"""Release of overloaded grippers on inextensible cables, as a monitor of the simulator."""

from __future__ import annotations

from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, EventStatus

from drake_aerial.plant.cable import Cable
from drake_aerial.plant.cable_tensions import CableTensions

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
