"""Model predictive control of a payload on cables at force level, by real-time iteration."""

from __future__ import annotations

import time
import warnings
from collections import deque

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from drake_aerial.control.controller import OFFSET, PayloadController
from drake_aerial.control.controller_parameters import MpcParameters
from drake_aerial.control.mpc.condensing import BoxProgram, CondensedProblem, thrust_box
from drake_aerial.control.mpc.field_of_view import view_penalty, view_violation
from drake_aerial.control.mpc.horizon import Horizon, pack
from drake_aerial.control.mpc.mpc_memory import MpcMemory, initial_guess, measured_state
from drake_aerial.control.mpc.separation import Separation
from drake_aerial.control.mpc.tracking_cost import TrackingCost
from drake_aerial.dynamics.discretization import change_chart, discretize, repeated
from drake_aerial.dynamics.flatness import Reference, ReferenceTable, reference_table
from drake_aerial.dynamics.linearization import linearize
from drake_aerial.dynamics.payload_model import PayloadState, retract, tangent_basis
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.dynamics.reference_changes import blown, disturbed
from drake_aerial.estimation.disturbance_observer import Disturbance, DisturbanceObserver
from drake_aerial.estimation.observation import Observation
from drake_aerial.estimation.wind_observer import WindObserver
from drake_aerial.geometry import Array
from drake_aerial.references.trajectory import Trajectory


class PayloadMpc(PayloadController):
    """MPC that tracks a trajectory with the payload's tracked point, and attitude if possible.

    Every `ticks_per_plan` control steps the model is linearised along the time-shifted previous
    solution, and one quadratic program in the commanded thrusts is solved (real-time iteration).
    The program is condensed. If its unconstrained minimum respects the thrust box it is the
    solution; otherwise PIQP solves the program. The first input is held until the next plan. The
    plan is state in the Context (`MpcMemory`). Double only.

    Plans start at the current time: measurements are `offset` old and are extrapolated, positions
    at the measured velocities, velocities and thrusts along the previous plan.

    With an observer, the observed disturbance or wind enters the prediction and the reference, so
    a constant one leaves no offset. A warning is issued once per flight if the estimate of a
    `DisturbanceObserver` exceeds its limits.

    The ports are those of `PayloadController`, and

    | port | size | meaning | unit | frame |
    |---|---|---|---|---|
    | out `diagnostics` | 5 | of the last plan, see below | -, -, m, N, - | - |

    The diagnostics are: QP iterations (0 without active bounds), number of active bounds,
    difference of the CoM's measured position from the previous plan, change of the first input,
    and number of control steps in which the observed disturbance was at a limit.

    `step_seconds` holds the CPU times of the last plans, a measurement and no state.

    Parameters
    ----------
    model : PayloadModelParameters
        Believed model.
    parameters : MpcParameters, optional
    offset : float
        Delay from a sensor sample to the control step that reads it [s].

    Raises
    ------
    InputError
        If the offset is not in [0, period).

    Examples
    --------
    >>> from drake_aerial import MpcParameters, PayloadMpc
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> inertia = [[6e-3, 0, 0], [0, 5.9e-3, 0], [0, 0, 1.07e-2]]
    >>> belief = PayloadModelParameters(mass=0.25, inertia=inertia, p_LC=[[0, 0, 0.14]])
    >>> PayloadMpc(belief, MpcParameters(integral_gain=0.3)).GetOutputPort("thrust_vectors").size()
    3
    """

    default_parameters = MpcParameters()

    def __init__(
        self,
        model: PayloadModelParameters,
        parameters: MpcParameters | None = None,
        *,
        offset: float = OFFSET,
    ):
        self.parameters = p = parameters or self.default_parameters
        self.horizon = horizon = Horizon(p.stages, p.step, p.ticks_per_plan * p.period, offset)
        self.step_seconds: deque[float] = deque(maxlen=100_000)
        n = self._n = model.n
        self._observer = None if p.observer == "off" else p.observer
        super().__init__(
            model,
            period=p.period,
            offset=offset,
            take_off=p.take_off,
            position_filter=p.position_filter,
        )
        self._fine_times = p.step * np.arange(horizon.ends[-1] + 1)
        self._cost = TrackingCost(model, p.weights, horizon)
        self._separation = Separation(model, p.separation) if n > 1 and p.separation else None
        self._problem = CondensedProblem(len(horizon), 12 + 7 * n, 3 * n)
        self._program = BoxProgram()
        self._low, self._high = np.tile(thrust_box(model), (1, len(horizon)))
        ticket = {self.all_state_ticket()}
        self.DeclareVectorOutputPort("diagnostics", 5, self._calc_diagnostics, ticket)

    def initial_memory(self) -> Array:
        """Return the initial vector of an `MpcMemory`: zeros."""
        observer = 0 if self._observer is None else self._observer.size(self._n)
        return np.zeros(MpcMemory.size(len(self.horizon), self._n, observer))

    def for_smaller_team(self, model: PayloadModelParameters) -> PayloadMpc:
        """Return the MPC of a smaller team; both record CPU times in the same list."""
        law = PayloadMpc(model, self.parameters, offset=self.offset)
        law.step_seconds = self.step_seconds
        return law

    def holds_plan(self, memory: Array) -> bool:
        """Return True between two plans, and count the control step; with an observer always False.

        The observer reads every sample.
        """
        if self._observer is not None:
            return False
        return self._is_current(memory)

    def compute_thrusts(
        self,
        t: float,
        observation: Observation,
        reference: Trajectory,
        thrust: Array,
        memory: Array,
    ) -> Array:
        """Make a plan and return its first input (n, 3) [N]; see `PayloadController`."""
        begin = time.thread_time()
        n, N = self._n, len(self.horizon)
        disturbance: Disturbance | None = None
        if self._observer is not None:
            disturbance = self._observe(self._observer, t, memory, observation, thrust)
            is_current = self._is_current(memory)
            if is_current and all(np.isfinite(field).all() for field in observation):
                return thrust
        state = self._unpack(memory)
        table = reference_table(self.model, reference)
        desired = self._desired(table, t, reference.yaw, disturbance)
        # Forces on the quadrotors act like thrust: from here on, F and u include both.
        observation = observation.after(self.offset)
        now = measured_state(self.model, observation, thrust)
        x, u, prediction_error = initial_guess(self.horizon, state, now, desired, disturbance)
        shift, p = state.shift, self.parameters
        if p.integral_gain > 0.0:
            error = desired.p[0] - observation.p
            shift = shift + p.integral_gain * p.ticks_per_plan * self.period * error
            shift = np.clip(shift, -p.integral_limit, p.integral_limit)
            desired = desired._replace(p=desired.p + shift)
        E = tangent_basis(x.xi)
        P = self._cost.terminal(table, reference.yaw)
        change, iterations, active = self._improve(x, u, E, desired, P, disturbance)
        if not np.isfinite(change).all():
            # The model cannot explain this state: hover, and begin a new plan at the next step.
            memory[:] = 0.0
            return np.full((n, 3), np.nan)
        u += change.reshape(N, n, 3)
        x = retract(x, self._problem.expand(change), E)
        memory[:] = MpcMemory(
            begun=1.0,
            iterations=iterations,
            active_bounds=active,
            prediction_error=prediction_error,
            correction=float(np.linalg.norm(change[: 3 * n])),
            limited_steps=state.limited_steps,
            age=0.0,
            shift=shift,
            inputs=u,
            states=pack(x),
            observer=state.observer,
        ).pack()
        self.step_seconds.append(time.thread_time() - begin)
        # The last bits of linear algebra depend on the alignment of arrays; rounding to whole
        # micronewtons makes flights reproducible to the bit.
        return np.round(u[0] if disturbance is None else u[0] - disturbance.on_quadrotors, 6)

    def _unpack(self, memory: Array) -> MpcMemory:
        return MpcMemory.unpack(memory, len(self.horizon), self._n)

    def _is_current(self, memory: Array) -> bool:
        """Count this control step in place, and return whether the plan is current."""
        begun, age = MpcMemory.count_step(memory)
        return bool(begun and age < self.parameters.ticks_per_plan)

    def _observe(
        self,
        observer: DisturbanceObserver | WindObserver,
        t: float,
        memory: Array,
        observation: Observation,
        thrust: Array,
    ) -> Disturbance:
        """Return the disturbance and update `memory` in place; warn once if it is limited."""
        state = self._unpack(memory)
        disturbance, after = observer.advance(
            self.model, state.observer, observation, thrust, self.period
        )
        if (
            disturbance.limited
            and not state.limited_steps
            and isinstance(observer, DisturbanceObserver)
        ):
            warnings.warn(
                f"at t = {t:.2f} s the estimated disturbance reached the limit `share` = "
                f"{observer.share:g} or `lever` = {observer.lever:g} m of DisturbanceObserver; "
                "raise them or correct the believed mass properties",
                RuntimeWarning,
                stacklevel=2,
            )
        limited_steps = state.limited_steps + disturbance.limited
        memory[:] = state._replace(observer=after, limited_steps=limited_steps).pack()
        return disturbance

    def _desired(
        self, table: ReferenceTable, t: float, yaw: float, disturbance: Disturbance | None
    ) -> Reference:
        """Return the reference at the states of a plan from t [s]; its inputs are means."""
        horizon = self.horizon
        fine = table.rows(t + self._fine_times)
        if disturbance is not None and disturbance.wind is not None:
            whole = blown(
                self.model, yaw, table.unpack(fine), disturbance.wind, self.parameters.step
            )
            fine = np.concatenate([field.reshape(len(fine), -1) for field in whole], axis=1)
        rows = fine[horizon.ends]
        rows[: len(horizon), table.inputs] = horizon.means @ fine[:-1, table.inputs]
        desired = table.unpack(rows)
        if disturbance is None:
            return desired
        return disturbed(self.model, yaw, desired, disturbance.wrench)

    def _improve(
        self,
        x: PayloadState,
        u: Array,
        E: Array,
        desired: Reference,
        P: Array,
        disturbance: Disturbance | None,
    ) -> tuple[Array, int, int]:
        """Return the change of the inputs (N 3 n,), the QP iterations, and active bounds."""
        N, horizon, view = len(self.horizon), self.horizon, self.parameters.field_of_view
        step, wrench, wind = self.parameters.step, None, None
        if disturbance is not None:
            wrench, wind = disturbance.wrench, disturbance.wind
        first = PayloadState(*(field[:N] for field in x))
        last = PayloadState(*(field[1:] for field in x))
        linear = linearize(self.model, first, u, E[:N], wrench, wind)
        discrete = change_chart(
            repeated(discretize(linear, step), horizon.units), first, E[:N], last, E[1:]
        )
        Q, q, r = self._cost.quadratic(x, u, E, desired, P)
        commanded = u
        if disturbance is not None:
            commanded = u - disturbance.on_quadrotors
        if self._separation is not None:
            missing, direction = self._separation.violation(x)
            if missing.max() > 0.0:
                weight = self.parameters.weights.separation * step * horizon.shares[:, None]
                J = self._separation.jacobian(x, direction, E)
                hessian, gradient = view_penalty(missing, J, weight)
                Q, q = Q + hessian, q + gradient
        if view is not None:
            aimed = x if disturbance is None else x._replace(F=x.F - disturbance.on_quadrotors)
            violation, J = view_violation(self.model, aimed, E, 0.5 * view)
            weight = self.parameters.weights.view * step * horizon.shares[:, None]
            hessian, gradient = view_penalty(violation, J, weight)
            Q, q = Q + hessian, q + gradient
        H, g = self._problem.condense(discrete, Q, q, self._cost.input_weights, r)
        low, high = self._low - commanded.ravel(), self._high - commanded.ravel()
        return self._program.solve(H, g, low, high)

    def _calc_diagnostics(self, context: Context, output: BasicVector) -> None:
        m = self._unpack(context.get_discrete_state(self._memory_index).value())
        output.SetFromVector(
            [m.iterations, m.active_bounds, m.prediction_error, m.correction, m.limited_steps]
        )
