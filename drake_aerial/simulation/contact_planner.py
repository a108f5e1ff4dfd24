"""Find the payload in a scan and contacts on it, in a diagram."""

from __future__ import annotations

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.contacts.transfer import transfer
from drake_aerial.errors import InputError
from drake_aerial.scene.object_choice import ObjectChoice, chosen_object
from drake_aerial.skill.contact_skill import ContactSkill


class ContactPlanner(LeafSystem):
    """Plan contacts on an object of a scan whenever a trigger rises.

    | port | size | meaning |
    |---|---|---|
    | in `scan` | abstract | `PointCloud` of a scene, as of a `DepthScanner` |
    | in `trigger` | 1 | contacts are planned when it rises above 0.5 |
    | out `contacts` | abstract | `ContactSolutions` in the scan's frame; None at first |

    The trigger is read at every period. Plan and last trigger are state in the Context. An error of
    the scene or of the transfer is raised by the simulation.

    Parameters
    ----------
    skill : ContactSkill
        The learnt skill.
    choice : ObjectChoice, optional
        Which object; by default the only one.
    period : float
        Time between readings of the trigger [s].
    seed : int
        Random seed of the transfer.
    parameters : TransferParameters, optional
        Parameters of the transfer.

    Raises
    ------
    InputError
        If the period is not positive.
    """

    def __init__(
        self,
        skill: ContactSkill,
        choice: ObjectChoice | None = None,
        *,
        period: float = 0.1,
        seed: int = 0,
        parameters: TransferParameters | None = None,
    ):
        super().__init__()
        if not period > 0.0:
            raise InputError(f"`period` of the contact planner must be positive [s], got {period}")
        self._skill, self._choice = skill, choice
        self._seed, self._transfer_parameters = seed, parameters
        self._scan = self.DeclareAbstractInputPort("scan", AbstractValue.Make(None))
        self._trigger = self.DeclareVectorInputPort("trigger", 1)
        self._last = self.DeclareDiscreteState(1)
        self._plan = self.DeclareAbstractState(AbstractValue.Make(None))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)
        self.DeclareStateOutputPort("contacts", self._plan)

    def plan(self, scan: PointCloud) -> ContactSolutions:
        """Return contacts on the chosen object of a scan.

        Raises
        ------
        InputError, JobError
            If the object is not found, or the skill has no contacts on it.
        """
        cloud = chosen_object(scan, self._choice)
        parameters = self._transfer_parameters
        return transfer(self._skill, cloud, seed=self._seed, parameters=parameters)

    def _update(self, context: Context, state: State) -> None:
        before = context.get_discrete_state(self._last).GetAtIndex(0)
        now = self._trigger.Eval(context)[0]
        state.get_mutable_discrete_state(self._last).SetAtIndex(0, now)
        if now > 0.5 >= before:
            contacts = self.plan(self._scan.Eval(context))
            state.get_mutable_abstract_state(int(self._plan)).set_value(contacts)
