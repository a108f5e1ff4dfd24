"""The main job, start to end: one demonstration, a new scan, contacts by two methods, two flights, a report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drake_aerial._version import __version__
from drake_aerial.errors import JobError
from drake_aerial.io.files import replacing

if TYPE_CHECKING:
    from drake_aerial.cloud.point_cloud import PointCloud
    from drake_aerial.contacts.solutions import ContactSolutions, Solution
    from drake_aerial.plant.payload import Payload
    from drake_aerial.simulation.trial import TrialResult

DEMONSTRATION = "flat"
PAYLOAD = "box_68x68x28"
VIEWPOINT = (1.1, -1.3, 1.5)
SCAN_NOISE = 0.002
METHODS = {"task": "learnt contact", "kopicki": "local shape alone"}

Progress = Callable[[float, str], None]


def scan_of(payload: Payload, *, seed: int) -> PointCloud:
    """Return what a depth camera at `VIEWPOINT` sees of a payload: a partial cloud with 2 mm of range noise."""
    import trimesh

    from drake_aerial.cloud.partial_views import partial_view

    mesh = trimesh.Trimesh(payload.vertices, payload.faces, process=False)
    return partial_view(mesh, VIEWPOINT, noise=SCAN_NOISE, rng=np.random.default_rng(seed))


def run_demo(out: str | Path, *, seed: int = 0, progress: Progress | None = None) -> str:
    """Do the main job once and write everything it gives.

    The payload was not demonstrated, and is seen from one side only. Contacts are found by the learnt task model and by
    local surface likeness alone (the baseline); the best contact of each is flown by the same controller.

    Parameters
    ----------
    out : str or Path
        Folder for scan.npz, skill.npz, contacts.json, metrics.json, trial.npz, contacts.png, flights.png, flight.html,
        report.html, and the baseline's files in baseline/.
    seed : int
        Seed of the scan, the transfer and the flights.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    str
        A summary of a few lines.

    Raises
    ------
    InputError
        If `out` cannot be written.
    JobError
        If a method finds no contact that can be flown.
    """
    from drake_aerial.contacts.transfer import transfer
    from drake_aerial.plant.payload import Payload
    from drake_aerial.simulation.trial import fly
    from drake_aerial.skill.demonstration import Demonstration
    from drake_aerial.skill.learn import learn
    from drake_aerial.visualization.contacts_figure import draw_contacts
    from drake_aerial.visualization.plots import plot_flights
    from drake_aerial.visualization.replay import write_replay

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

    contacts: dict[str, ContactSolutions] = {}
    flights: dict[str, TrialResult] = {}
    heats: dict[str, np.ndarray] = {}
    folders = {"task": out, "kopicki": out / "baseline"}
    for index, (method, label) in enumerate(METHODS.items()):
        tell(0.05 + 0.1 * index, f"finding contacts: {label}")
        contacts[label] = transfer(skill, scan, method=method, seed=seed)
        contacts[label].write(folders[method] / "contacts.json")
        heats[label] = _heat(contacts[label])
    for index, (method, label) in enumerate(METHODS.items()):
        start = 0.25 + 0.25 * index
        flights[label] = fly(
            contacts[label],
            payload=payload,
            solution=_best(contacts[label], label).rank,
            seed=seed,
            progress=lambda fraction, what, start=start, label=label: tell(
                start + 0.25 * fraction, f"flying: {label}"
            ),  # type: ignore[misc]
        )
        flights[label].save(folders[method])

    tell(0.75, "drawing the contacts")
    points = contacts["learnt contact"].query.scan.features_S.p  # type: ignore[union-attr]
    draw_contacts(out / "contacts.png", skill, points, contacts, heats=heats)
    tell(0.88, "drawing the flights")
    plot_flights(flights, out / "flights.png")
    tell(0.92, "recording the replay")
    for method, label in METHODS.items():
        write_replay(folders[method] / "flight.html", flights[label], title=f"{label}: {PAYLOAD}")
    tell(0.98, "writing the report")
    _write_report(out, payload, scan, contacts, flights)
    tell(1.0, "done")
    return _summary(out, flights)


def _best(solutions: ContactSolutions, label: str) -> Solution:
    best = solutions.best
    if best is None:
        reasons = sorted(
            {str(reason) for solution in solutions.solutions for reason in solution.reasons}
        )
        raise JobError(
            f"{label}: none of {len(solutions)} contacts can be flown: {', '.join(reasons)}"
        )
    return best


def _heat(solutions: ContactSolutions) -> np.ndarray:
    """Return the likelihood of a contact at each feature, in 0..1."""
    assert solutions.query is not None
    log = solutions.query.log_surface()
    return np.exp(log - log.max())


def _off_center(solution: Solution, payload: Payload) -> float:
    """Return the horizontal distance of the (mean) contact from the payload's centre of mass [m]."""
    from drake_aerial.geometry import transform

    return float(
        np.linalg.norm((solution.X_SG.p.mean(0) - transform(payload.X_SP, payload.com))[:2])
    )


def _write_report(
    out: Path,
    payload: Payload,
    scan: PointCloud,
    contacts: dict[str, ContactSolutions],
    flights: dict[str, TrialResult],
) -> None:
    from drake_aerial.visualization.report import Section, metrics_table, write_report

    ours, baseline = METHODS["task"], METHODS["kopicki"]
    metrics = {label: flight.metrics for label, flight in flights.items()}
    off = {label: 100 * _off_center(_best(contacts[label], label), payload) for label in contacts}
    rmse = {label: 100 * metrics[label]["position_rmse_m"] for label in metrics}
    answer = (
        f"<b>{off[ours]:.1f} cm</b> from the payload's centre of mass, seen from above, is where the learnt contact went; "
        f"without the demonstration's task model it went {off[baseline]:.1f} cm off. Flown by the same controller, the "
        f"payload stayed within <b>{rmse[ours]:.1f} cm</b> of its path (root mean square), against {rmse[baseline]:.1f} cm."
    )
    sections = [
        Section(
            "What was shown, and what was asked",
            [
                "<b>Shown, once:</b> a parcel of 68 x 61 x 28 cm, of which only the top face was visible, and a magnetic "
                "gripper in the middle of that face. No mass, no model, no explanation.",
                f"<b>Asked:</b> where does the gripper belong on <i>another</i> payload? Its scan has {len(scan):,} points, seen "
                f"by one depth camera with {1000 * SCAN_NOISE:.0f} mm of noise, so that its far sides are missing. Its mass "
                "and centre of mass are not known to the method.",
            ],
        ),
        Section(
            "Where the gripper goes",
            [
                "Each row is one way to answer, its five best contacts from left to right. The colour of the scan says how "
                "likely a contact is there: grey unlikely, red likely. A red title names why a contact cannot be flown.",
                f"<i>{ours}</i> asks both whether the surface <i>looks like</i> the demonstrated one, and whether it <i>lies</i> "
                f"where the demonstrated one lay relative to the object's edges. <i>{baseline}</i> asks only the first, and "
                "flat is flat anywhere.",
            ],
            out / "contacts.png",
            "Left: the demonstration (red: the surface at the contact; black: the features that say where it lies). "
            "Then the five best contacts of each method on the new scan.",
        ),
        Section(
            "How it flies",
            [
                "One quadrotor lifts the payload from the ground by its cable, flies a circle of 1 m radius twice in 12 s, and "
                "hovers. The controller knows only where the gripper is: it takes the centre of mass to be straight below it. "
                "The better the contact, the truer that is. The payload's measured position carries 1 cm of noise.",
                metrics_table(metrics),
            ],
            out / "flights.png",
            "The two flights over time; dotted lines separate the phases.",
        ),
        Section(
            "Watch it",
            [
                '<iframe src="flight.html" title="replay" loading="lazy"></iframe>',
                'The flight with the learnt contact (<a href="flight.html">on its own page</a>); '
                '<a href="baseline/flight.html">the flight with the other contact</a>.',
            ],
        ),
        Section(
            "With a scan of your own",
            [
                "<pre>drake-aerial transfer flat my_scan.ply --viewpoint 0 0 1.5 --out contacts.json --html contacts.html\n"
                "drake-aerial fly contacts.json --mass 0.25 --out flight\n"
                "drake-aerial view flight/trial.npz</pre>",
                f'<span class="muted">drake-aerial {__version__}; demonstration <code>{DEMONSTRATION}</code>, payload '
                f"<code>{PAYLOAD}</code> ({payload.mass:g} kg). Beside this page: contacts.json, metrics.json and trial.npz of "
                "the learnt contact, skill.npz, scan.npz, and the other contact's files in baseline/. The table's numbers are "
                "those of metrics.json, which also holds the full configuration.</span>",
            ],
        ),
    ]
    write_report(
        out / "report.html",
        title="One demonstration, a new payload, a flight",
        answer=answer,
        sections=sections,
    )


def _summary(out: Path, flights: dict[str, TrialResult]) -> str:
    lines = [f"{label:>18}: {flight.summary()}" for label, flight in flights.items()]
    return "\n".join([*lines, f"open {out / 'report.html'}"])
