"""Fly a contact solution: from contacts.json to a `TrialResult`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_aerial.control.trajectory import Trajectory
from drake_aerial.errors import InputError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.transport.flight import Flight
from drake_aerial.transport.outcome import Progress
from drake_aerial.transport.station_parameters import StationParameters
from drake_aerial.transport.suspension import Suspension, read_scan
from drake_aerial.transport.trial_result import TrialResult

if TYPE_CHECKING:
    from drake_aerial.perception.point_cloud import PointCloud
    from drake_aerial.transferring.solutions import ContactSolutions


def prepare_flight(
    contacts: ContactSolutions | str | Path,
    *,
    payload: Payload | str | Path | None = None,
    mass: float | None = None,
    solution: int = 1,
    cloud: PointCloud | None = None,
    belief: str = "below_contact",
    controller: str = "mpc",
    trajectory: str | Path | Trajectory = "transport",
    cable: str | CableParameters | None = None,
    noise: float | None = None,
    parameters: StationParameters | None = None,
    controller_options: dict[str, Any] | None = None,
    mass_ratio: float = 1.0,
) -> Flight:
    """Return the `Flight` of one contact solution, to be run with many seeds; parameters and errors as of `fly`."""
    from drake_aerial.transferring.solutions import ContactSolutions

    beside = None
    if not isinstance(contacts, ContactSolutions):
        beside = Path(contacts).parent
        contacts = ContactSolutions.read(contacts)
    chosen = next((s for s in contacts.solutions if s.rank == solution), None)
    if chosen is None:
        ranks = ", ".join(str(s.rank) for s in contacts.solutions) or "none"
        raise InputError(f"no solution of rank {solution}: these contacts have the ranks {ranks}")
    if payload is not None and not isinstance(payload, Payload):
        payload = Payload.read(payload)
    scan = read_scan(contacts.cloud, beside, needed=payload is None) if cloud is None else cloud
    suspension = Suspension.hang(
        payload,
        chosen.X_SG.p,
        chosen.normal,
        scan=scan,
        mass=mass,
        centroid=contacts.cloud.get("centroid"),
        up=contacts.cloud.get("up"),
    )
    parameters = StationParameters() if parameters is None else parameters
    if cable is not None:
        if isinstance(cable, CableParameters):
            parameters = replace(parameters, cable=cable)
        else:
            parameters = parameters.with_cable_kind(cable)
    if noise is not None:
        parameters = replace(parameters, noise=noise)
    return Flight(
        suspension,
        belief=belief,
        controller=controller,
        trajectory=trajectory,
        parameters=parameters,
        controller_options=controller_options,
        mass_ratio=mass_ratio,
        source={"method": contacts.method, "skill": contacts.skill, "seed": contacts.seed, "solution": solution},
    )


def fly(
    contacts: ContactSolutions | str | Path,
    *,
    payload: Payload | str | Path | None = None,
    mass: float | None = None,
    solution: int = 1,
    seed: int = 0,
    cloud: PointCloud | None = None,
    belief: str = "below_contact",
    controller: str = "mpc",
    trajectory: str | Path | Trajectory = "transport",
    cable: str | CableParameters | None = None,
    noise: float | None = None,
    parameters: StationParameters | None = None,
    controller_options: dict[str, Any] | None = None,
    mass_ratio: float = 1.0,
    progress: Progress | None = None,
) -> TrialResult:
    """Fly one solution of a transfer, from the ground.

    Parameters
    ----------
    contacts : ContactSolutions or path
        The solutions, or their contacts.json.
    payload : Payload, path or name, optional
        What really hangs there; by default the scan's closed hull of uniform density, of `mass`.
    mass : float, optional
        Of a payload known by its scan alone [kg]; 0.25 by default.
    solution : int
        Rank of the solution.
    seed : int
        Of the measurement noise and the wind.
    cloud : PointCloud, optional
        The scan, if it is not where contacts.json says.
    belief : str
        What the controller takes for the centre of mass: below_contact, geometric or true.
    controller : str
        mpc, geometric_ff or geometric.
    trajectory : str, path or Trajectory
        "transport" (also called "circle"), hover, line, waypoints, or a YAML file.
    cable : str or CableParameters, optional
        "inextensible" (default) or "elastic".
    noise : float, optional
        Standard deviation of the measured payload position, per coordinate [m]; 0.01 by default.
    parameters : StationParameters, optional
        Everything else about the station: unequal teams, wind, motor lag.
    controller_options : dict, optional
        Further arguments of the controller.
    mass_ratio : float
        What the controller takes for the payload's mass, over the true one.
    progress : callable, optional
        Called with the fraction flown and a word on it.

    Returns
    -------
    TrialResult
        Also of a flight that dropped, crashed or diverged: see its outcome.

    Raises
    ------
    InputError
        For bad input: an unknown name or rank, a contact more than 2 cm off the payload, a payload too heavy to lift.
    """
    flight = prepare_flight(
        contacts,
        payload=payload,
        mass=mass,
        solution=solution,
        cloud=cloud,
        belief=belief,
        controller=controller,
        trajectory=trajectory,
        cable=cable,
        noise=noise,
        parameters=parameters,
        controller_options=controller_options,
        mass_ratio=mass_ratio,
    )
    return flight.run(seed, progress=progress)
