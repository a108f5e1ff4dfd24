"""One station and one trajectory, to be simulated with any number of seeds."""

import time
from collections import deque
from dataclasses import asdict
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from drake_aerial._version import __version__
from drake_aerial.dynamics.payload_parameters import PayloadModelParameters
from drake_aerial.errors import one_line
from drake_aerial.io.record_text import record_to_mapping
from drake_aerial.parallel import one_blas_thread
from drake_aerial.references.trajectory_files import read_trajectory, trajectory_to_dict
from drake_aerial.simulation.beliefs import believed_model, suspended_properties
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.lift_check import check_formation, check_team
from drake_aerial.simulation.metrics import flight_metrics
from drake_aerial.simulation.outcome import FlightMonitor, Progress, Watch
from drake_aerial.simulation.path_preparation import carried_payload, prepare_path
from drake_aerial.simulation.recording import phase_names, record
from drake_aerial.simulation.station import TransportStation, make_transport_station
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.simulation.trial_result import SCHEMA, VERSION, TrialResult
from drake_aerial.statics.gravity import GRAVITY


class Flight:
    """A station with its controller and a trajectory, ready for trials with different seeds.

    Use it instead of `fly` for trials that differ in the seed alone: Drake never frees a diagram
    that holds Python systems.

    Attributes
    ----------
    suspended_payload : SuspendedPayload
    options : FlightOptions
    model : PayloadModelParameters
        The model that the controller uses.
    station : TransportStation
    trajectory : Trajectory
        As it is flown, after retiming.
    path : PreparedPath
        The trajectory and the result of its check.
    configuration : dict
        The entry `configuration` of metrics.json.

    Examples
    --------
    >>> from drake_aerial import Flight, FlightOptions, Payload, SuspendedPayload
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> box = SuspendedPayload.from_contacts(box, [[0.0, 0.0, 0.1]], [[0.0, 0.0, 1.0]])
    >>> flight = Flight(box, FlightOptions(trajectory=HoverTrajectory(hover_time=0.5)))
    >>> [flight.run(seed).outcome for seed in (0, 1)]
    ['completed', 'completed']
    """

    def __init__(
        self,
        suspended_payload: SuspendedPayload,
        options: FlightOptions | None = None,
        *,
        source: dict[str, Any] | None = None,
    ):
        """Prepare a flight.

        Parameters
        ----------
        suspended_payload : SuspendedPayload
        options : FlightOptions, optional
        source : dict, optional
            Origin of the contacts, for the record.

        Raises
        ------
        InputError
            If an option is bad, or the team cannot lift the payload and `force` is not set.
        JobError
            If taut cables cannot hold the payload (all contacts on one side of its true centre of
            mass, or more tension than a quadrotor lifts), or the path needs more than there is, and
            `force` is not set.
        """
        self.suspended_payload = suspended_payload
        self.options = options = options or FlightOptions()
        payload, p_LC = suspended_payload.payload, suspended_payload.p_LC
        parameters = options.station_parameters
        quadrotors = parameters.quadrotors(len(p_LC))
        self.model: PayloadModelParameters = believed_model(
            options.belief,
            payload,
            p_LC,
            scan_L=suspended_payload.scan_L,
            quadrotors=quadrotors,
            cable=parameters.cable,
            gripper=parameters.gripper,
            mass_ratio=options.mass_ratio,
            air=parameters.air,
        )
        mass, com, _ = suspended_properties(payload, p_LC, parameters.gripper)
        if not options.force:
            cables = parameters.cables(len(p_LC))
            check_team(payload, mass, quadrotors, cables)
            check_formation(p_LC - com, mass, quadrotors, cables)
        self._weight = GRAVITY * mass
        self.path = prepare_path(
            read_trajectory(options.trajectory),
            carried_payload(suspended_payload, parameters),
            options.path_limits,
            retiming=options.retime,
            force=options.force,
        )
        self.trajectory = self.path.trajectory
        self.station: TransportStation = make_transport_station(
            payload,
            p_LC,
            suspended_payload.normal_L,
            controller=options.make_controller(self.model),
            parameters=parameters,
            force=options.force,
        )
        self.configuration = self._describe(source or {})

    def _describe(self, source: dict[str, Any]) -> dict[str, Any]:
        """Return everything that defines the flight, as JSON values."""
        options, payload = self.options, self.suspended_payload.payload
        known = options.controller_parameters
        return {
            "package_version": __version__,
            "belief": options.belief,
            "mass_ratio": options.mass_ratio,
            "forced": options.force,
            "after_drop_s": options.after_drop,
            "controller": options.controller_name,
            "controller_options": {
                key: repr(value) for key, value in (options.controller_options or {}).items()
            },
            "controller_parameters": known and _json_value(record_to_mapping(known)),
            "trajectory": trajectory_to_dict(self.trajectory),
            "path_check": _json_value(self.path.record),
            "station": _json_value(asdict(options.station_parameters)),
            "payload": {
                "name": payload.name,
                "mass": payload.mass,
                "com_L": payload.com.tolist(),
                "inertia": payload.inertia.tolist(),
                "stands_alone": self.station.payload_body.stands_alone,
                **(
                    {"assumptions": [assumption.to_dict() for assumption in payload.assumptions]}
                    if payload.assumptions
                    else {}
                ),
            },
            "contacts_L": self.suspended_payload.p_LC.tolist(),
            "contacts_moved_m": self.suspended_payload.moved.tolist(),
            "believed_com_L": self.model.p_LLcm.tolist(),
            "source": source,
        }

    @one_blas_thread
    def run(
        self, seed: int = 0, *, progress: Progress | None = None, watch: Watch | None = None
    ) -> TrialResult:
        """Simulate one trial and return its result, also if the flight fails.

        Parameters
        ----------
        seed : int
            Random seed of measurement noise and wind.
        progress : callable, optional
            Called with the fraction flown and the phase every 0.2 s of simulated time.
        watch : callable, optional
            Called with the station's context every 0.02 s of simulated time; must not change it.
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
        station.install(simulator)
        steps: deque[float] = getattr(station.controller, "step_seconds", deque())
        steps.clear()
        start = time.process_time()
        try:
            # A diverging plan is discarded by the controller and needs no NumPy warning.
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                simulator.Initialize()
                simulator.AdvanceTo(trajectory.duration)
        except (RuntimeError, ArithmeticError, ValueError) as error:
            # Solver or controller failed at a state outside the flight envelope.
            if monitor.is_open:
                monitor.end("diverged", one_line(error)[:200], context.get_time())
        cpu_time = time.process_time() - start
        series = record(station, context, trajectory)
        names = phase_names(trajectory)
        metrics = {
            "schema": SCHEMA,
            "version": VERSION,
            "outcome": monitor.outcome,
            "outcome_reason": monitor.reason,
            "outcome_time_s": monitor.time,
            "after_drop": monitor.after_drop,
            **flight_metrics(series, names, self._weight),
            "timing": {
                "real_time_factor": context.get_time() / max(cpu_time, 1e-9),
                "mpc_step_ms": _step_times(steps),
            },
            "seed": seed,
            "configuration": self.configuration,
        }
        payload = self.suspended_payload.payload
        length = station.parameters.cable_lengths(station.n)
        return TrialResult(
            metrics, series, names, payload.vertices, payload.faces, station.p_LC, length
        )


def _step_times(seconds: deque[float]) -> dict[str, float | None]:
    """Return mean and 99th percentile of the controller's step times [ms], without the first."""
    milliseconds = 1e3 * np.array(seconds)[1:]
    if not len(milliseconds):
        return {"mean": None, "p99": None}
    return {"mean": float(milliseconds.mean()), "p99": float(np.percentile(milliseconds, 99))}


def _json_value(value: Any) -> Any:
    """Return a nested value as JSON stores it: tuples as lists, infinite numbers as text."""
    if isinstance(value, dict):
        return {key: _json_value(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json_value(entry) for entry in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
