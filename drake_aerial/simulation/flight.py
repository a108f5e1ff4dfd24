"""One station and one trajectory, ready to be flown with any number of seeds."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import asdict
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_aerial._version import __version__
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.io.typed_yaml.writing import record_to_mapping
from drake_aerial.parallel import one_blas_thread
from drake_aerial.references.trajectory_files import read_trajectory, trajectory_to_dict
from drake_aerial.simulation.beliefs import believed_model, suspended_properties
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.lift_check import check_formation, check_team
from drake_aerial.simulation.metrics import flight_metrics
from drake_aerial.simulation.outcome import FlightMonitor, Progress, Watch
from drake_aerial.simulation.recording import phase_names, record
from drake_aerial.simulation.station import TransportStation, make_transport_station
from drake_aerial.simulation.suspended_payload import Suspension
from drake_aerial.simulation.trial_result import SCHEMA, VERSION, TrialResult
from drake_aerial.statics.gravity import GRAVITY


class Flight:
    """A flight that is ready: one station and one trajectory, for any number of trials with different seeds.

    Use it instead of `fly` where trials differ in the seed alone: Drake keeps every diagram with Python systems for good.

    Attributes
    ----------
    suspension : Suspension
    options : FlightOptions
    model : PayloadModelParameters
        What the controller believes.
    station : TransportStation
    trajectory : Trajectory
    configuration : dict
        What goes into metrics.json.
    """

    def __init__(
        self,
        suspension: Suspension,
        options: FlightOptions | None = None,
        *,
        source: dict[str, Any] | None = None,
        **changes: Any,
    ):
        """Prepare a flight.

        Parameters
        ----------
        suspension : Suspension
        options : FlightOptions, optional
        source : dict, optional
            Where the contacts are from, for the record.
        **changes
            Fields of `FlightOptions` that are to differ from `options`.

        Raises
        ------
        InputError
            For a bad option, or a payload too heavy to lift.
        JobError
            For a formation from which taut cables cannot hold the payload: all contacts on one side of its true centre of mass, or
            more tension than a quadrotor lifts. Neither of the last two with the option `force`.
        """
        self.options = options = FlightOptions.merged(options, changes)
        parameters = options.station_parameters
        # "circle" is what one flies; the trajectory that does so is called after its task.
        self.trajectory = read_trajectory(
            "transport" if options.trajectory == "circle" else options.trajectory
        )
        self.suspension = suspension
        self.model: PayloadModelParameters = believed_model(
            options.belief,
            suspension.payload,
            suspension.p_LC,
            scan_L=suspension.scan_L,
            quadrotors=parameters.quadrotors(len(suspension.p_LC)),
            cable=parameters.cable,
            gripper=parameters.gripper,
            mass_ratio=options.mass_ratio,
        )
        hanging, com, _ = suspended_properties(
            suspension.payload, suspension.p_LC, parameters.gripper
        )
        if not options.force:
            n = len(suspension.p_LC)
            team = parameters.quadrotors(n), parameters.cables(n)
            check_team(suspension.payload, hanging, *team)
            check_formation(suspension.p_LC - com, hanging, *team)
        self._weight = GRAVITY * hanging
        self.station: TransportStation = make_transport_station(
            suspension.payload,
            suspension.p_LC,
            suspension.normal_L,
            controller=options.make_controller(self.model),
            parameters=parameters,
            force=options.force,
        )
        payload, known = suspension.payload, options.controller_parameters
        self.configuration = {
            "package_version": __version__,
            "belief": options.belief,
            "mass_ratio": options.mass_ratio,
            "forced": options.force,
            "after_drop_s": options.after_drop,
            "controller": options.controller_name,
            "controller_options": {
                key: repr(value) for key, value in (options.controller_options or {}).items()
            },
            "controller_parameters": known and _plain(record_to_mapping(known)),
            "trajectory": trajectory_to_dict(self.trajectory),
            "station": _plain(asdict(parameters)),
            "payload": {
                "name": payload.name,
                "mass": payload.mass,
                "com_L": payload.com.tolist(),
                "inertia": payload.inertia.tolist(),
                "stands_alone": self.station.payload_body.stands_alone,
            },
            "contacts_L": suspension.p_LC.tolist(),
            "contacts_moved_m": suspension.moved.tolist(),
            "believed_com_L": self.model.p_LLcm.tolist(),
            "source": source or {},
        }

    @one_blas_thread
    def run(
        self, seed: int = 0, *, progress: Progress | None = None, watch: Watch | None = None
    ) -> TrialResult:
        """Fly once and return what happened; a flight that fails is a result too.

        Parameters
        ----------
        seed : int
            Of the measurement noise and the wind.
        progress : callable, optional
            Called with the fraction flown and a word on it every 0.2 s of simulated time.
        watch : callable, optional
            Called with the station's context every 0.02 s of simulated time, to look at and not to change.
        """
        station = self.station
        simulator = Simulator(station)
        context = simulator.get_mutable_context()
        trajectory = station.place(context, seed=seed, reference=self.trajectory)
        assert trajectory is not None
        monitor = FlightMonitor(
            station, trajectory, after_drop=self.options.after_drop, progress=progress, watch=watch
        )
        simulator.set_monitor(monitor)
        steps: deque[float] = getattr(station.controller, "step_seconds", deque())
        steps.clear()
        began = time.process_time()
        try:
            # A plan that explodes is thrown away by the controller itself, not worth a warning.
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                simulator.Initialize()
                simulator.AdvanceTo(trajectory.duration)
        except (RuntimeError, ArithmeticError, ValueError) as error:
            # The solver or a controller gave up on a state that is far from any flight.
            if monitor.is_open:
                monitor.end("diverged", " ".join(str(error).split())[:200], context.get_time())
        spent = time.process_time() - began
        series = record(station, context, trajectory)
        names = phase_names(trajectory)
        milliseconds = 1e3 * np.array(steps)[1:]
        metrics = {
            "schema": SCHEMA,
            "version": VERSION,
            "outcome": monitor.outcome,
            "outcome_reason": monitor.reason,
            "outcome_time_s": monitor.time,
            "after_drop": monitor.after_drop,
            **flight_metrics(series, names, self._weight),
            "timing": {
                "real_time_factor": context.get_time() / max(spent, 1e-9),
                "mpc_step_ms": {
                    "mean": float(milliseconds.mean()) if len(milliseconds) else None,
                    "p99": float(np.percentile(milliseconds, 99)) if len(milliseconds) else None,
                },
            },
            "seed": seed,
            "configuration": self.configuration,
        }
        payload, n = self.suspension.payload, station.n
        length = station.parameters.cable_lengths(n)
        return TrialResult(
            metrics, series, names, payload.vertices, payload.faces, station.p_LC, length
        )


def _plain(value: Any) -> Any:
    """Return a nested value as JSON gives it back: tuples are lists, an infinite number becomes its name."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
