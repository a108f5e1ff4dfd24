"""The demo: one demonstration, a new scan, contacts by two methods, two flights, a report."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial._version import __version__
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import JobError
from drake_aerial.geometry import transform
from drake_aerial.io.files import replacing
from drake_aerial.plant.payload import Payload
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.visualization.html_report import EmbeddedImage, write_html_report

DEMONSTRATION = "flat"
PAYLOAD = "box_68x68x28"
VIEWPOINT = (1.1, -1.3, 1.5)
"""Position of the depth camera in the scan's frame [m]."""
SCAN_NOISE = 0.002
"""Standard deviation of the camera's range [m]."""
METHODS = {"task": "learnt contact", "kopicki": "local shape alone"}

# Key of metrics.json, name in the table, factor, unit format.
_METRICS: tuple[tuple[str, str, float, str], ...] = (
    ("outcome", "outcome", 1.0, "{}"),
    ("position_rmse_m", "distance from the planned path, root mean square", 100.0, "{:.1f} cm"),
    ("position_max_m", "largest distance from the planned path", 100.0, "{:.1f} cm"),
    ("tilt_max_rad", "largest tilt of the payload", 57.29578, "{:.0f}°"),
    ("attitude_rmse_rad", "attitude error with heading, root mean square", 57.29578, "{:.1f}°"),
    ("thrust_mean_N", "mean thrust", 1.0, "{:.2f} N"),
    ("moment_rms_N_m", "moments, root mean square", 1000.0, "{:.1f} mN m"),
    ("tension_max_N", "largest cable tension", 1.0, "{:.1f} N"),
    ("slack_fraction", "time with a slack cable", 100.0, "{:.1f} %"),
)

Progress = Callable[[float, str], None]


def scan_of(payload: Payload, *, seed: int) -> PointCloud:
    """Return the view of a payload from a depth camera at `VIEWPOINT`, with noise."""
    from drake_aerial.cloud.partial_views import partial_view

    rng = np.random.default_rng(seed)
    return partial_view(payload.to_trimesh(), VIEWPOINT, noise=SCAN_NOISE, rng=rng)


def run_demo(out: str | Path, *, seed: int = 0, progress: Progress | None = None) -> str:
    """Run the demo and write all results.

    The payload was not demonstrated and is seen from one side only. Contacts are found by the
    learnt task model and by local surface likeness alone (the baseline); the best contact of each
    is flown by the same controller.

    Parameters
    ----------
    out : str or Path
        Folder for scan.npz, skill.npz, contacts.json, metrics.json, trial.npz, contacts.png,
        flights.png, flight.html, report.html, and for the baseline's files in baseline/.
    seed : int
        Seed of the scan, the transfer and the flights.
    progress : callable, optional
        Called with the fraction done and the current step.

    Returns
    -------
    str
        A summary of a few lines.

    Raises
    ------
    InputError
        If `out` cannot be written.
    JobError
        If a method finds no feasible contact.
    """
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn

    tell = progress or (lambda fraction, what: None)
    out = Path(out)
    tell(0.0, "learning from one demonstration")
    skill = learn(Demonstration.read(DEMONSTRATION), seed=seed)
    skill.save(out / "skill.npz")
    tell(0.03, "scanning the payload")
    payload = Payload.read(PAYLOAD)
    scan = scan_of(payload, seed=seed)
    with replacing(out / "scan.npz") as temporary:
        np.savez_compressed(temporary, points=scan.points, viewpoint=np.array(VIEWPOINT))
    folders = {METHODS["task"]: out, METHODS["kopicki"]: out / "baseline"}
    contacts = _transfer(skill, scan, folders, seed, tell)
    flights = _fly(contacts, payload, folders, seed, tell)
    _draw(out, skill, contacts, flights, folders, tell)
    tell(0.98, "writing the report")
    _write_report(out, payload, scan, contacts, flights)
    tell(1.0, "done")
    lines = [f"{label:>18}: {flight.summary()}" for label, flight in flights.items()]
    return "\n".join([*lines, f"open {out / 'report.html'}"])


def _transfer(
    skill: ContactSkill, scan: PointCloud, folders: Mapping[str, Path], seed: int, tell: Progress
) -> dict[str, ContactSolutions]:
    """Return the contacts by label, and write them."""
    from drake_aerial.contacts.transfer import transfer

    contacts = {}
    for index, (method, label) in enumerate(METHODS.items()):
        tell(0.05 + 0.1 * index, f"finding contacts: {label}")
        contacts[label] = transfer(skill, scan, method=method, seed=seed)
        contacts[label].write(folders[label] / "contacts.json")
    return contacts


def _fly(
    contacts: Mapping[str, ContactSolutions],
    payload: Payload,
    folders: Mapping[str, Path],
    seed: int,
    tell: Progress,
) -> dict[str, TrialResult]:
    """Return the flight of the best contact by label, and write them."""
    from drake_aerial.simulation import trial

    flights = {}
    for index, (label, solutions) in enumerate(contacts.items()):
        start, what = 0.25 + 0.25 * index, f"flying: {label}"

        def tell_part(fraction: float, _: str, start: float = start, what: str = what) -> None:
            tell(start + 0.25 * fraction, what)

        flights[label] = trial.fly(
            solutions,
            payload=payload,
            solution=_best(solutions, label).rank,
            seed=seed,
            progress=tell_part,
        )
        flights[label].save(folders[label])
    return flights


def _draw(
    out: Path,
    skill: ContactSkill,
    contacts: Mapping[str, ContactSolutions],
    flights: Mapping[str, TrialResult],
    folders: Mapping[str, Path],
    tell: Progress,
) -> None:
    """Write contacts.png, flights.png and the replays."""
    from drake_aerial.visualization.contacts_figure import draw_contacts
    from drake_aerial.visualization.flight_plots import plot_flights
    from drake_aerial.visualization.replay import write_replay

    tell(0.75, "drawing the contacts")
    heats, points = {}, np.zeros((0, 3))
    for label, solutions in contacts.items():
        assert solutions.query is not None
        log, points = solutions.query.log_surface(), solutions.query.scan.features_S.p
        heats[label] = np.exp(log - log.max())
    draw_contacts(out / "contacts.png", skill, points, contacts, heats=heats)
    tell(0.88, "drawing the flights")
    plot_flights(flights, out / "flights.png")
    tell(0.92, "recording the replays")
    for label, flight in flights.items():
        write_replay(folders[label] / "flight.html", flight, title=f"{label}: {PAYLOAD}")


def _best(solutions: ContactSolutions, label: str) -> Solution:
    best = solutions.best
    if best is None:
        reasons = sorted(
            {str(reason) for solution in solutions.solutions for reason in solution.reasons}
        )
        raise JobError(
            f"{label}: all {len(solutions)} contacts are infeasible: {', '.join(reasons)}; "
            "try another seed"
        )
    return best


def _horizontal_offset(solution: Solution, payload: Payload) -> float:
    """Return the horizontal distance of the mean contact from the centre of mass [m]."""
    p_C = transform(payload.X_SP, payload.com)
    return float(np.linalg.norm((solution.X_SG.p.mean(0) - p_C)[:2]))


def _write_report(
    out: Path,
    payload: Payload,
    scan: PointCloud,
    contacts: Mapping[str, ContactSolutions],
    flights: Mapping[str, TrialResult],
) -> None:
    offset = {
        label: f"{100 * _horizontal_offset(_best(found, label), payload):.1f}"
        for label, found in contacts.items()
    }
    metrics = [flight.metrics for flight in flights.values()]
    values: dict[str, Any] = {
        "title": "One demonstration, a new payload, a flight",
        "ours": METHODS["task"],
        "baseline": METHODS["kopicki"],
        "offset": offset,
        "rmse": {
            label: f"{100 * flight.metrics['position_rmse_m']:.1f}"
            for label, flight in flights.items()
        },
        "points": f"{len(scan):,}",
        "noise_mm": f"{1000 * SCAN_NOISE:.0f}",
        "contacts": EmbeddedImage.read(out / "contacts.png"),
        "flights": EmbeddedImage.read(out / "flights.png"),
        "labels": list(flights),
        "metrics": [
            (name, [_cell(own.get(key), factor, form) for own in metrics])
            for key, name, factor, form in _METRICS
        ],
        "version": __version__,
        "demonstration": DEMONSTRATION,
        "payload": PAYLOAD,
        "mass": f"{payload.mass:g}",
    }
    write_html_report(out / "report.html", "demo_report.html", values)


def _cell(value: Any, factor: float, form: str) -> str:
    if value is None:
        return "–"
    return form.format(value if isinstance(value, str) else factor * value)
