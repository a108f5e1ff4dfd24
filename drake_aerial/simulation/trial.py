"""Fly a contact solution: from contacts.json to a `TrialResult`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydrake.systems.framework import LeafSystem

from drake_aerial.choices import Belief, CableKind, Retiming
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.scan_lookup import find_scan
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.control.controller_parameters import ControllerParameters
from drake_aerial.dynamics.path_limits import LIMITS, PathLimits
from drake_aerial.errors import InputError, JobError
from drake_aerial.plant.cable import CableParameters
from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import Trajectory
from drake_aerial.simulation.flight import Flight
from drake_aerial.simulation.flight_options import FlightOptions
from drake_aerial.simulation.lift_check import FORCE
from drake_aerial.simulation.outcome import Progress
from drake_aerial.simulation.station_parameters import StationParameters
from drake_aerial.simulation.suspended_payload import SuspendedPayload
from drake_aerial.simulation.trial_result import TrialResult


def prepare_flight(
    contacts: ContactSolutions | str | Path,
    *,
    payload: Payload | str | Path | None = None,
    mass: float | None = None,
    solution: int = 1,
    cloud: PointCloud | None = None,
    belief: Belief = "below_contact",
    controller: str | ControllerParameters | Callable[..., LeafSystem] = "mpc",
    trajectory: str | Path | Trajectory = "transport",
    cable: CableKind | CableParameters | None = None,
    noise: float | None = None,
    parameters: StationParameters | None = None,
    controller_options: dict[str, Any] | None = None,
    mass_ratio: float = 1.0,
    after_drop: float = 3.0,
    retime: Retiming | None = None,
    path_limits: PathLimits | None = LIMITS,
    force: bool = False,
) -> Flight:
    """Return the `Flight` of a contact solution, to be run with many seeds.

    Parameters and errors are those of `fly`.

    Examples
    --------
    >>> from drake_aerial import prepare_flight, read_scan, read_skill, transfer
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), method="centroid")
    >>> flight = prepare_flight(contacts, payload="box_68x68x28", trajectory="hover")
    >>> model = flight.model  # believes the centre of mass below the contact
    >>> model.p_LLcm[:2].round(3).tolist() == model.p_LC[0, :2].round(3).tolist()
    True
    """
    options = FlightOptions(
        belief=belief,
        controller=controller,
        trajectory=trajectory,
        cable=cable,
        noise=noise,
        parameters=parameters,
        controller_options=controller_options,
        mass_ratio=mass_ratio,
        after_drop=after_drop,
        retime=retime,
        path_limits=path_limits,
        force=force,
    )
    folder = None
    if not isinstance(contacts, ContactSolutions):
        folder = Path(contacts).parent
        contacts = ContactSolutions.read(contacts)
    chosen = next((s for s in contacts.solutions if s.rank == solution), None)
    if chosen is None:
        ranks = ", ".join(str(s.rank) for s in contacts.solutions) or "none"
        raise InputError(f"`solution` must be one of the ranks {ranks}, got {solution}")
    if not (chosen.feasible or force):
        reasons = "; ".join(map(str, chosen.reasons)) or "no reason is given"
        raise JobError(f"solution {solution} is marked infeasible: {reasons}; {FORCE}")
    if payload is not None and not isinstance(payload, Payload):
        payload = Payload.read(payload)
    suspended_payload = SuspendedPayload.from_contacts(
        payload,
        chosen.X_SG.p,
        chosen.normal,
        scan=_scan(contacts, folder, needed=payload is None) if cloud is None else cloud,
        mass=mass,
        centroid=contacts.cloud.get("centroid"),
        up=contacts.cloud.get("up"),
    )
    source = {
        "method": contacts.method,
        "skill": contacts.skill,
        "seed": contacts.seed,
        "solution": solution,
    }
    return Flight(suspended_payload, options, source=source)


# More than 80 lines, since the docstring lists every keyword.
def fly(
    contacts: ContactSolutions | str | Path,
    *,
    payload: Payload | str | Path | None = None,
    mass: float | None = None,
    solution: int = 1,
    seed: int = 0,
    cloud: PointCloud | None = None,
    progress: Progress | None = None,
    belief: Belief = "below_contact",
    controller: str | ControllerParameters | Callable[..., LeafSystem] = "mpc",
    trajectory: str | Path | Trajectory = "transport",
    cable: CableKind | CableParameters | None = None,
    noise: float | None = None,
    parameters: StationParameters | None = None,
    controller_options: dict[str, Any] | None = None,
    mass_ratio: float = 1.0,
    after_drop: float = 3.0,
    retime: Retiming | None = None,
    path_limits: PathLimits | None = LIMITS,
    force: bool = False,
) -> TrialResult:
    """Fly one solution of a transfer, from the ground.

    Parameters
    ----------
    contacts : ContactSolutions or path
        The solutions, or their contacts.json.
    payload : Payload, path or name, optional
        The payload that is flown; by default the scan's closed hull, of uniform density and `mass`.
    mass : float, optional
        Mass of a payload that is known by its scan alone [kg]; 0.25 by default.
    solution : int
        Rank of the solution.
    seed : int
        Random seed of measurement noise and wind.
    cloud : PointCloud, optional
        The scan, if contacts.json names no file or the file has moved.
    progress : callable, optional
        Called with the fraction flown and the phase.
    belief : str
        Centre of mass and inertia that the controller believes in: below_contact, geometric or
        true.
    controller : str, MpcParameters, GeometricParameters or callable
        mpc, geometric_ff or geometric, or parameters; or your own function or class, which takes
        the believed `PayloadModelParameters` and returns a LeafSystem.
    trajectory : str, path or Trajectory
        transport (lift, two turns of a 1 m circle, hover), hover, line, waypoints, or a YAML file.
    cable : str or CableParameters, optional
        inextensible or elastic, or all parameters of the cables; by default as in `parameters`.
    noise : float, optional
        Standard deviation of the measured payload position, per coordinate [m]; by default as in
        `parameters`.
    parameters : StationParameters, optional
        The station: team, wind, sensors, motor lag; by default the paper's values.
    controller_options : dict, optional
        Further keyword arguments of the controller.
    mass_ratio : float
        Believed mass of the payload over its true mass.
    after_drop : float
        Time that is simulated after a gripper lets go while others hold [s].
    retime : str, optional
        slower: impossible parts of the path take as long as they need; fastest: the path is flown
        as fast as the limits permit. By default an impossible path is refused.
    path_limits : PathLimits, optional
        Margins of the check of the path before take-off; None to check nothing.
    force : bool
        Fly although the contacts are marked infeasible, no taut equilibrium exists, the payload is
        too heavy, or the path is impossible.

    Returns
    -------
    TrialResult
        Also of a flight that dropped, crashed or diverged: see its `outcome`.

    Raises
    ------
    InputError
        If a name or rank is unknown, a contact is more than 2 cm from the payload, the scan is
        needed and not found, or the payload is too heavy and `force` is not set.
    JobError
        If `force` is not set and the solution is marked infeasible, or taut cables cannot hold the
        payload by these contacts (all on one side of its true centre of mass, or more tension than
        a quadrotor lifts), or the path is impossible.

    Examples
    --------
    >>> from drake_aerial import fly, read_scan, read_skill, transfer
    >>> from drake_aerial.references.trajectory import HoverTrajectory
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), method="centroid")
    >>> hover = HoverTrajectory(hover_time=1.0)
    >>> result = fly(contacts, payload="box_68x68x28", trajectory=hover)
    >>> result.outcome, result.metrics["position_rmse_m"] < 0.02
    ('completed', True)
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
        after_drop=after_drop,
        retime=retime,
        path_limits=path_limits,
        force=force,
    )
    return flight.run(seed, progress=progress)


def _scan(contacts: ContactSolutions, folder: Path | None, *, needed: bool) -> PointCloud | None:
    """Return the scan of contacts, or None if it is not found and not needed.

    Raises
    ------
    InputError
        If it is needed and not found.
    """
    # Without a scan file the payload's own surface is used, as with contacts.json.
    if contacts.scan is not None and (needed or contacts.scan.path):
        return contacts.scan
    try:
        return find_scan(contacts.cloud, folder)
    except InputError as error:
        if not needed:
            return None
        raise InputError(
            f"{error}; give the scan (`cloud`, --cloud) or a payload (`payload`, --payload)"
        ) from error
