"""Fly a contact solution: from contacts.json to a `TrialResult`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_aerial.errors import InputError, JobError
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.lift_check import FORCE
from drake_aerial.simulation.outcome import Progress
from drake_aerial.simulation.suspended_payload import Suspension, read_scan
from drake_aerial.simulation.trial_result import TrialResult

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.contacts.solutions import ContactSolutions


def prepare_flight(
    contacts: ContactSolutions | str | Path,
    *,
    payload: Payload | str | Path | None = None,
    mass: float | None = None,
    solution: int = 1,
    cloud: PointCloud | None = None,
    options: FlightOptions | None = None,
    **changes: Any,
) -> Flight:
    """Return the `Flight` of one contact solution, to be run with many seeds; parameters and errors as of `fly`.

    Examples
    --------
    >>> from drake_aerial import prepare_flight, read_scan, read_skill, transfer
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), method="centroid")
    >>> flight = prepare_flight(contacts, payload="box_68x68x28", trajectory="hover")
    >>> flight.model.p_LLcm[:2].round(3).tolist() == flight.model.p_LC[0, :2].round(3).tolist()  # belief: below the contact
    True
    """
    from drake_aerial.contacts.solutions import ContactSolutions

    beside = None
    if not isinstance(contacts, ContactSolutions):
        beside = Path(contacts).parent
        contacts = ContactSolutions.read(contacts)
    chosen = next((s for s in contacts.solutions if s.rank == solution), None)
    if chosen is None:
        ranks = ", ".join(str(s.rank) for s in contacts.solutions) or "none"
        raise InputError(f"no solution of rank {solution}: these contacts have the ranks {ranks}")
    options = FlightOptions.merged(options, changes)
    if not (chosen.feasible or options.force):
        reasons = "; ".join(chosen.reasons) or "no reason is given"
        raise JobError(
            f"solution {solution} cannot be flown, its contacts are marked infeasible: {reasons}; {FORCE}"
        )
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
    return Flight(
        suspension,
        options,
        source={
            "method": contacts.method,
            "skill": contacts.skill,
            "seed": contacts.seed,
            "solution": solution,
        },
    )


def fly(
    contacts: ContactSolutions | str | Path,
    *,
    payload: Payload | str | Path | None = None,
    mass: float | None = None,
    solution: int = 1,
    seed: int = 0,
    cloud: PointCloud | None = None,
    progress: Progress | None = None,
    options: FlightOptions | None = None,
    **changes: Any,
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
    progress : callable, optional
        Called with the fraction flown and a word on it.
    options : FlightOptions, optional
        How to fly: belief, controller, trajectory, cable, noise, team, wind.
    **changes
        Fields of `FlightOptions` that are to differ from `options`: `fly(contacts, controller="geometric", noise=0.0)`.

    Returns
    -------
    TrialResult
        Also of a flight that dropped, crashed or diverged: see its outcome.

    Raises
    ------
    InputError
        For bad input: an unknown name or rank, a contact more than 2 cm off the payload, a payload too heavy to lift.
    JobError
        If what was asked for is known not to fly, and `force` is not set: the solution is marked infeasible, or taut cables cannot hold the
        payload by these contacts (all on one side of its true centre of mass, more tension than a quadrotor lifts).

    Examples
    --------
    >>> from drake_aerial import fly, read_scan, read_skill, transfer
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), method="centroid")
    >>> result = fly(contacts, payload="box_68x68x28", trajectory=HoverTrajectory(hover_time=1.0))
    >>> result.outcome, result.metrics["position_rmse_m"] < 0.02
    ('completed', True)
    """
    flight = prepare_flight(
        contacts,
        payload=payload,
        mass=mass,
        solution=solution,
        cloud=cloud,
        options=options,
        **changes,
    )
    return flight.run(seed, progress=progress)
