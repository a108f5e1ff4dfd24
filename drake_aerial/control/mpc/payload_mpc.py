"""Model predictive control of a payload on cables, at force level, by real-time iteration."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import piqp
from pydrake.systems.framework import BasicVector, Context
from scipy.linalg import lapack

from drake_aerial.control.controller import OFFSET, PERIOD, PayloadController
from drake_aerial.control.mpc.condensing import CondensedProblem
from drake_aerial.control.mpc.field_of_view import view_penalty, view_violation
from drake_aerial.control.mpc.horizon import STAGES, Horizon, normalized, pack, unpack
from drake_aerial.control.mpc.tracking_error import deviation, deviation_jacobian, terminal_cost
from drake_aerial.dynamics.discretization import change_chart, discretize, repeated
from drake_aerial.dynamics.flatness import Reference, ReferenceTable, disturbed, reference_table
from drake_aerial.dynamics.linearization import linearize
from drake_aerial.dynamics.payload_model import PayloadState, retract, tangent_basis
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import InputError
from drake_aerial.estimation.disturbance_observer import Disturbance, DisturbanceObserver
from drake_aerial.estimation.observation import Observation
from drake_aerial.geometry import Array, cross
from drake_aerial.references.trajectory import Trajectory


@dataclass(frozen=True)
class MpcWeights:
    """Weights per second of horizon on squared deviations, and on squared deviations of the commanded thrusts.

    Attributes
    ----------
    position, velocity : float
        Of the tracked point [1/m^2, s^2/m^2].
    attitude, rate : float
        Of the payload under several cables [1/rad^2, s^2/rad^2].
    swing, swing_rate : float
        The same of the payload's tilt under one cable. It is not actuated but swings, and a large weight on it
        makes a flight with a wrong belief of the centre of mass unstable.
    direction, direction_rate : float
        Of the cables [1/rad^2, s^2/rad^2].
    thrust : float
        Of the thrusts [1/N^2].
    input : float
        Of the commanded thrusts [1/N^2].
    view : float
        Of the cosine by which the payload is out of a camera's view, where a field of view is given.
    """

    position: float = 100.0
    velocity: float = 10.0
    attitude: float = 2.0
    rate: float = 0.5
    swing: float = 0.2
    swing_rate: float = 0.3
    direction: float = 2.0
    direction_rate: float = 0.5
    thrust: float = 0.0
    input: float = 1.0
    view: float = 2e4

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"the MPC's weight {field.name} is {value!r}; 0 or more accepted")
        if self.input == 0.0:
            raise InputError("the MPC's weight input is 0; a positive number accepted")


class PayloadMpc(PayloadController):
    """Tracks a trajectory with the payload's tracked point, and its attitude as far as the cables allow.

    Every `ticks_per_plan` ticks it linearises the model once along its last solution, moved on in time, and solves one
    quadratic program in the commanded thrusts (real-time iteration). The program is condensed; where its
    unconstrained minimum respects the thrust box it is the solution, else PIQP finds it. What is carried from
    tick to tick (the predicted states and inputs) lives in the Context. Double only.

    A plan begins at the moment of the tick, to which the samples, `offset` older, are moved on: positions at the measured velocities
    (`Observation.after`), velocities and thrusts by what the last plan has them change.

    Ports are those of `PayloadController` and

    | port | size | meaning |
    |---|---|---|
    | out `diagnostics` | 4 | QP iterations, active bounds, prediction error [m], correction [N] |

    Without an active bound there are no iterations; the prediction error is that of the CoM's position since the
    last tick, the correction the size of the first input's change.

    How long steps take is a measurement, not a state: `step_seconds` holds the CPU times of the last ones.

    Parameters
    ----------
    model : PayloadModelParameters
        What the controller believes.
    stages : int or sequence of int
        The lengths of the horizon's N steps, in units of `step`; a number alone is so many equal steps. The default looks 1 s ahead:
        0.2 s finely and the rest in steps twice as long, at some three fifths of the cost of 20 equal ones.
    step : float
        h, the shortest step [s].
    ticks_per_plan : int
        How many ticks a plan serves: at the others its first input, which is meant for all of `step`, is held. Two cost half of the
        time of one and next to no accuracy.
    weights : MpcWeights
    integral_gain : float
        Rate at which a remaining position error moves the reference [1/s]; 0 is off.
    integral_limit : float
        Largest shift of the reference by that [m].
    field_of_view : float, optional
        Full angle [rad] of a camera under each quadrotor that looks against the thrust. The payload is kept in its
        view as a soft constraint; None is off.
    observer : DisturbanceObserver, optional
        Of forces and a moment that the model does not know of: wind, a wrong mass or centre of mass. What it observes
        enters the prediction and the reference, so that no constant one leaves an offset. None is off.

    Examples
    --------
    >>> from drake_aerial import PayloadMpc
    >>> from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
    >>> belief = PayloadModelParameters(mass=0.25, inertia=[[6e-3, 0, 0], [0, 5.9e-3, 0], [0, 0, 1.07e-2]], p_LC=[[0, 0, 0.14]])
    >>> PayloadMpc(belief, integral_gain=0.3).GetOutputPort("thrust_vectors").size()
    3
    """

    def __init__(
        self,
        model: PayloadModelParameters,
        *,
        stages: int | Sequence[int] = STAGES,
        step: float = 0.05,
        ticks_per_plan: int = 2,
        weights: MpcWeights | None = None,
        integral_gain: float = 0.0,
        integral_limit: float = 0.3,
        field_of_view: float | None = None,
        observer: DisturbanceObserver | None = None,
        **keywords: Any,
    ):
        if field_of_view is not None and not 0.0 < field_of_view < np.pi:
            raise InputError(f"field_of_view must be between 0 and pi rad but got {field_of_view}")
        if not (isinstance(ticks_per_plan, int) and ticks_per_plan > 0):
            raise InputError(
                f"an MPC's ticks_per_plan must be a whole number from 1 up but got {ticks_per_plan!r}"
            )
        ahead = ticks_per_plan * keywords.get("period", PERIOD)
        self.horizon = horizon = Horizon(stages, step, ahead, keywords.get("offset", OFFSET))
        self.stages, self.step, self.field_of_view = len(horizon), step, field_of_view
        self.ticks_per_plan = ticks_per_plan
        self._ahead = np.arange(horizon.ends[-1] + 1)
        self.observer = observer
        self.weights = weights or MpcWeights()
        self.integral_gain, self.integral_limit = integral_gain, integral_limit
        self.step_seconds: deque[float] = deque(maxlen=100_000)
        self._n = model.n
        super().__init__(model, **keywords)
        n, w = model.n, self.weights
        turn, spin = [w.swing, w.swing, 0.0], [w.swing_rate, w.swing_rate, 0.0]
        if n > 1:
            turn, spin = [w.attitude] * 3, [w.rate] * 3
        self._Q = step * np.concatenate(
            [
                np.repeat([w.position, w.velocity], 3),
                turn,
                spin,
                np.repeat([w.direction, w.direction_rate, w.thrust], [2 * n, 2 * n, 3 * n]),
            ]
        )
        self._R = step * np.full(3 * n, w.input)
        self._weights = horizon.shares[:, None, None] * np.diag(self._Q)
        self._input_weights = np.repeat(horizon.units, 3 * n).reshape(-1, 3 * n) * self._R
        self._problem = CondensedProblem(len(horizon), len(self._Q), 3 * n)
        self._terminal: dict[float, Array] = {}
        self._low, self._high = np.tile(thrust_box(model), (1, len(horizon)))
        self._qp: Any = None
        ticket = {self.all_state_ticket()}
        self.DeclareVectorOutputPort("diagnostics", 4, self._calc_diagnostics, ticket)

    def _initial_memory(self) -> Array:
        n = self._n
        observed = 0 if self.observer is None else self.observer.size(n)
        return np.zeros(self._plan_end + observed)

    @property
    def _plan_end(self) -> int:
        return _HEADER + self.stages * 3 * self._n + (self.stages + 1) * (18 + 9 * self._n)

    def _reduced(self, model: PayloadModelParameters) -> PayloadMpc:
        law = PayloadMpc(
            model,
            stages=self.horizon.units.tolist(),
            step=self.step,
            ticks_per_plan=self.ticks_per_plan,
            weights=self.weights,
            integral_gain=self.integral_gain,
            integral_limit=self.integral_limit,
            field_of_view=self.field_of_view,
            observer=self.observer,
            period=self.period,
        )
        law.step_seconds = self.step_seconds
        return law

    def _fly(
        self, t: float, seen: Observation, reference: Trajectory, thrust: Array, memory: Array
    ) -> Array:
        begin = time.thread_time()
        n, N, h, horizon = self._n, self.stages, self.step, self.horizon
        pushed: Disturbance | None = None
        if self.observer is not None:
            pushed = self.observer.step(
                self.model, memory[self._plan_end :], seen, thrust, self.period
            )
            if self._counted(memory) and all(np.isfinite(field).all() for field in seen):
                return thrust
        table = reference_table(self.model, reference)
        fine = table.rows(t + h * self._ahead)
        rows = fine[horizon.ends]
        rows[:N, table.inputs] = horizon.means @ fine[:-1, table.inputs]
        desired = table.unpack(rows)
        plan = memory[_HEADER : self._plan_end]
        if pushed is not None:
            desired = disturbed(self.model, reference.yaw, desired, pushed.wrench)
        # What pushes on a quadrotor acts as thrust does: from here on, thrusts and inputs are the sums of the two.
        seen = seen.after(self.offset)
        now = self._measured(seen, thrust)
        if memory[0]:
            u = (horizon.shift_inputs @ plan[: N * 3 * n].reshape(N, -1)).reshape(N, n, 3)
            rows = plan[N * 3 * n :].reshape(N + 1, -1)
            x = normalized(unpack(horizon.shift_states @ rows, n))
            lapse = unpack((horizon.lapse @ rows)[None], n)
            now = now._replace(
                v=now.v + lapse.v, W=now.W + lapse.W, w=now.w + lapse.w, F=now.F + lapse.F
            )
        if pushed is not None:
            now = now._replace(F=now.F + pushed.on_quadrotors)
        if not memory[0]:
            x = PayloadState(*(np.repeat(field, N + 1, axis=0) for field in now))
            u = desired.F[:N].copy()
        surprise = np.abs(x.p[0] - now.p[0]).max()
        for field, measured in zip(x, now):
            field[0] = measured[0]
        if self.integral_gain > 0.0:
            shifted = memory[5:8] + self.integral_gain * self.ticks_per_plan * self.period * (
                desired.p[0] - seen.p
            )
            memory[5:8] = np.clip(shifted, -self.integral_limit, self.integral_limit)
            desired = desired._replace(p=desired.p + memory[5:8])
        E = tangent_basis(x.xi)
        P = self._terminal_cost(table, reference.yaw)
        change, iterations, active = self._improve(x, u, E, desired, P, pushed)
        if not np.isfinite(change).all():
            memory[:] = 0.0  # a state that no model explains: hover, and plan anew at the next tick
            return np.full((n, 3), np.nan)
        u += change.reshape(N, n, 3)
        x = retract(x, self._problem.expand(change), E)
        memory[0:5] = 1.0, iterations, active, surprise, np.linalg.norm(change[: 3 * n])
        memory[8] = 0.0
        plan[: N * 3 * n] = u.ravel()
        plan[N * 3 * n :] = pack(x).ravel()
        self.step_seconds.append(time.thread_time() - begin)
        # Linear algebra differs in its last bits with the alignment of its arrays; whole micronewtons keep a flight the same to the bit.
        return np.round(u[0] if pushed is None else u[0] - pushed.on_quadrotors, 6)

    def _hold(self, memory: Array) -> bool:
        # The observer wants to see every sample.
        return self.observer is None and self._counted(memory)

    def _counted(self, memory: Array) -> bool:
        """Count a tick, and return whether the last plan serves it."""
        memory[8] += 1.0
        return bool(memory[0] and memory[8] < self.ticks_per_plan)

    def _measured(self, seen: Observation, thrust: Array) -> PayloadState:
        """Return the model's state (batch of 1); the thrust is the command's part along each quadrotor's axis."""
        c = self.model.p_LLcm
        F = (thrust * seen.z_WQ).sum(-1, keepdims=True) * seen.z_WQ
        p, v = seen.p + seen.R @ c, seen.v + seen.R @ cross(seen.W, c)
        return PayloadState(*(field[None] for field in (p, v, seen.R, seen.W, seen.xi, seen.w, F)))

    def _improve(
        self,
        x: PayloadState,
        u: Array,
        E: Array,
        desired: Reference,
        P: Array,
        pushed: Disturbance | None,
    ) -> tuple[Array, int, int]:
        """Return the change of the inputs (N 3 n,), the QP's iterations, and how many bounds are active."""
        N, horizon = self.stages, self.horizon
        first = PayloadState(*(field[:N] for field in x))
        last = PayloadState(*(field[1:] for field in x))
        linear = linearize(self.model, first, u, E[:N], None if pushed is None else pushed.wrench)
        discrete = change_chart(
            repeated(discretize(linear, self.step), horizon.units), first, E[:N], last, E[1:]
        )
        e = deviation(self.model, x, desired, E)
        C = deviation_jacobian(self.model, x)
        CT = C.mT
        Q, q = self._weights.copy(), horizon.shares[:, None] * self._Q * e
        Q[:N, :12, :12] = CT[:N] @ ((horizon.shares[:N, None] * self._Q[:12])[:, :, None] * C[:N])
        Q[N], q[N] = P, P @ e[N]
        Q[N, :12] = CT[N] @ P[:12]
        Q[N, :, :12] = Q[N, :, :12] @ C[N]
        q[:, :12] = np.vecmat(q[:, :12], C)
        if self.field_of_view is not None:
            aimed = x if pushed is None else x._replace(F=x.F - pushed.on_quadrotors)
            violation, J = view_violation(self.model, aimed, E, 0.5 * self.field_of_view)
            hessian, gradient = view_penalty(
                violation, J, self.weights.view * self.step * horizon.shares[:, None]
            )
            Q, q = Q + hessian, q + gradient
        r = self._input_weights * (u - desired.u[:N]).reshape(N, -1)
        H, g = self._problem.condense(discrete, Q, q, self._input_weights, r)
        taken = u if pushed is None else u - pushed.on_quadrotors
        return self._solve(H, g, self._low - taken.ravel(), self._high - taken.ravel())

    def _solve(self, H: Array, g: Array, low: Array, high: Array) -> tuple[Array, int, int]:
        _, solution, failed = lapack.dposv(H.T, -g, lower=0)
        if not failed and (solution >= low).all() and (solution <= high).all():
            return solution, 0, 0
        if not (np.isfinite(H).all() and np.isfinite(g).all()):
            return np.full(len(g), np.nan), 0, 0
        H = np.tril(H) + np.tril(H, -1).T
        if self._qp is None:
            self._qp = piqp.DenseSolver()
            self._qp.settings.eps_abs = self._qp.settings.eps_rel = 1e-6
            self._qp.setup(H, g, x_l=low, x_u=high)
        else:
            self._qp.update(P=H, c=g, x_l=low, x_u=high)
        self._qp.solve()
        solution = np.clip(self._qp.result.x, low, high)
        active = int(((solution - low < 1e-4) | (high - solution < 1e-4)).sum())
        return solution, int(self._qp.result.info.iter), active

    def _terminal_cost(self, table: ReferenceTable, yaw: float) -> Array:
        if yaw not in self._terminal:
            rest = table.at(np.array([np.inf]))
            self._terminal[yaw] = terminal_cost(self.model, rest, self._Q, self._R, self.step)
        return self._terminal[yaw]

    def _calc_diagnostics(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state(self._memory_index).value()[1:5])


_HEADER = 9  # begun, four diagnostics, integral (3), ticks since the plan was made


def thrust_box(model: PayloadModelParameters) -> Array:
    """Return the lowest and highest commanded thrust vectors, (2, 3 n) [N]: tilted by up to 45 deg at full thrust."""
    side = np.sqrt(0.5) * model.max_thrust
    low = np.stack([-side, -side, model.min_thrust], axis=1)
    high = np.stack([side, side, model.max_thrust], axis=1)
    return np.stack([low.ravel(), high.ravel()])
