"""Tensions of inextensible cables as a system, and the holding forces of grippers."""

import warnings

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_aerial.geometry import Array
from drake_aerial.plant.cable import Cable
from drake_aerial.plant.cable_geometry import contact_offsets
from drake_aerial.statics.gravity import GRAVITY


class HoldingForces:
    """Holding forces of the grippers of n cables.

    Attributes
    ----------
    limit : (n,) array
        Holding force along the contact's normal [N]; infinite for a gripper that never lets go.
    """

    def __init__(self, cables: list[Cable]):
        self.limit = np.array([cable.gripper.parameters.holding_force for cable in cables])
        self._normal_L = np.stack([cable.gripper.normal_L for cable in cables])

    @property
    def are_finite(self) -> bool:
        """True if a gripper has a finite holding force, so that it can release."""
        return bool(np.isfinite(self.limit).any())

    def exceeded(self, tension: Array, xi: Array, R_WL: Array) -> NDArray[np.bool_]:
        """Return which grippers (n,) are pulled by more than their holding force.

        Parameters
        ----------
        tension : (n,) array [N]
        xi : (n, 3) array
            Cable directions in the world, from quadrotor to contact.
        R_WL : (3, 3) array
            Rotation of the payload.
        """
        normal_W = self._normal_L @ R_WL.T
        pull = tension * np.maximum(0.0, -np.einsum("ij,ij->i", xi, normal_W))
        return pull > self.limit


def safe_slide_rate(cable: Cable, time_step: float) -> float:
    """Return the rate of a cable's prismatic joint below which no overload is possible [m/s].

    A taut cable pulls with less than 1.5 times the thrust and weight of its quadrotor, swinging
    included. A larger tension needs an impact, which stops the quadrotor's mass within one step.
    """
    quadrotor = cable.quadrotor.parameters
    steady = 1.5 * (quadrotor.thrust_limits[1] + quadrotor.mass * GRAVITY)
    return (cable.gripper.parameters.holding_force - steady) * time_step / quadrotor.mass


_NOTHING_DONE = EventStatus.DidNothing()


class CableTensions(LeafSystem):
    """Tensions of n inextensible cables, from the reaction forces of their prismatic joints.

    | port | size | meaning |
    |---|---|---|
    | in `reaction_forces` | abstract | the plant's port of that name |
    | in `payload_state` | 13 | w x y z, position, angular and linear velocity of L in the world |
    | in `quadrotor_states` | 13 n | the same of each Q |
    | in `slide_0` ... | 2 each | position [m] and rate [m/s] of a cable's prismatic joint |
    | out `tension` | n | [N]; 0 while slack |
    | out `attached` | n | 1 attached, 0 released (discrete state, set by `GripperRelease`) |

    A system cannot release a gripper, because the status of a constraint is a parameter of the
    plant's context; a monitor does it (`CableSystem.install`). It runs before the events of this
    system. So a gripper that is overloaded in an event stays attached although it should not, and
    the event gives a RuntimeWarning, once per context and gripper.
    """

    def __init__(self, plant: MultibodyPlant, cables: list[Cable]):
        super().__init__()
        n = len(cables)
        self._joints = [int(cable.slide.index()) for cable in cables if cable.slide is not None]
        model_value = plant.get_reaction_forces_output_port().Allocate()
        self._forces = self.DeclareAbstractInputPort("reaction_forces", model_value)
        self._payload_state = self.DeclareVectorInputPort("payload_state", 13)
        self._quadrotor_states = self.DeclareVectorInputPort("quadrotor_states", 13 * n)
        self._slides = [self.DeclareVectorInputPort(f"slide_{i}", 2) for i in range(n)]
        self._attached = self.DeclareDiscreteState(np.ones(n))
        self._warned = self.DeclareDiscreteState(np.zeros(n))
        self._tension = self.DeclareVectorOutputPort(
            "tension", n, self._calc, {self._forces.ticket()}
        )
        self.DeclareStateOutputPort("attached", self._attached)
        self._p_LC = np.stack([cable.gripper.p_LC for cable in cables])
        self._holding = HoldingForces(cables)
        self._safe_rates = [safe_slide_rate(cable, plant.time_step()) for cable in cables]
        self.can_release = self._holding.are_finite
        if self.can_release:
            self.DeclarePeriodicDiscreteUpdateEvent(plant.time_step(), 0.0, self._warn)

    def _calc(self, context: Context, output: BasicVector) -> None:
        forces = self._forces.Eval(context)
        # The joint's axis is its frame's -z, so the force that holds the gripper back is along +z.
        output.SetFromVector([max(0.0, forces[j].translational()[2]) for j in self._joints])

    def overloaded(self, context: Context) -> list[int]:
        """Return the attached grippers that are pulled by more than their holding force.

        Parameters
        ----------
        context : Context
            Context of this system.
        """
        # The tensions are slow to read, so most steps end here.
        for slide, safe_rate in zip(self._slides, self._safe_rates):
            if abs(slide.Eval(context)[1]) >= safe_rate:
                break
        else:
            return []
        tension = self._tension.Eval(context)
        if not (tension > self._holding.limit).any():
            return []
        offsets = contact_offsets(
            self._payload_state.Eval(context), self._quadrotor_states.Eval(context), self._p_LC
        )
        distance = np.linalg.norm(offsets.p_QC_W, axis=1)
        xi = offsets.p_QC_W / np.maximum(distance, 1e-9)[:, None]
        attached = context.get_discrete_state(self._attached).value() > 0.5
        exceeded = attached & self._holding.exceeded(tension, xi, offsets.R_WL)
        return np.flatnonzero(exceeded).tolist()

    def release(self, context: Context, i: int) -> None:
        """Set gripper i to released in this system's context; see `GripperRelease.let_go`."""
        context.get_mutable_discrete_state(self._attached).SetAtIndex(i, 0.0)

    def _warn(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        overloaded = self.overloaded(context)
        if not overloaded:
            return _NOTHING_DONE
        warned = context.get_discrete_state(self._warned).value().copy()
        for i in overloaded:
            if not warned[i]:
                warnings.warn(
                    f"gripper {i + 1} of {len(warned)} is pulled by more than its holding force of "
                    f"{self._holding.limit[i]:g} N but stays attached: call "
                    "station.install(simulator), or CableSystem.install(simulator), before the "
                    "simulation so that it lets go",
                    RuntimeWarning,
                    stacklevel=2,
                )
        warned[overloaded] = 1.0
        discrete_state.set_value(self._warned, warned)
        return EventStatus.Succeeded()
