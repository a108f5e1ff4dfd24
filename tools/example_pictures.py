"""Run the examples and draw the pictures of docs/examples.md from what they computed.

    tools/run python tools/example_pictures.py [NAME...]

They are written to docs/images/examples/, one for each example; no screen is needed.
"""

import argparse
import runpy
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.geometry import Pose, transform
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import BLACK, GREEN, GREY, ORANGE, RED
from drake_aerial.visualization.flight_plots import COLORS
from drake_aerial.visualization.matplotlib_figure import figure, save_figure
from drake_aerial.visualization.method_meshes import contacts_mesh, features_mesh, skill_mesh
from drake_aerial.visualization.rendering import render

ROOT = Path(__file__).parent.parent
PICTURES = ROOT / "docs" / "images" / "examples"
Names = Mapping[str, Any]
"""Variables of an example after its last line."""


def show(axis: Any, image: np.ndarray, title: str) -> None:
    """Draw a rendered image without its margins."""
    drawn = (image < 250).any(axis=2)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    axis.imshow(image[rows[0] : rows[-1], columns[0] : columns[-1]])
    axis.set_title(title, fontsize=10)
    axis.axis("off")


def flown(flight: TrialResult, count: int = 4) -> ColoredMesh:
    """Return payload, cables and quadrotors at `count` times, with the payload's path."""
    mesh, series = ColoredMesh(), flight.series
    for k in np.linspace(0, len(series["time"]) - 1, count).astype(int):
        X_WL = Pose(series["payload_position"][k], series["payload_quaternion"][k])
        mesh.add_mesh(transform(X_WL, flight.vertices), flight.faces, color=GREY)
        for p_Q, q_Q, p_C in zip(
            series["quadrotor_position"][k],
            series["quadrotor_quaternion"][k],
            series["contact_position"][k],
            strict=True,
        ):
            mesh.add_tube([p_Q, p_C], color=BLACK, radius=0.006)
            mesh.add_quadrotor(Pose(p_Q, q_Q), arm=0.13)
    mesh.add_tube(series["payload_position"][::10], color=ORANGE, radius=0.006)
    return mesh


def curves(axis: Any, flights: Mapping[str, TrialResult], title: str, axes: str = "xyz") -> None:
    """Plot the distance from the reference over time [cm], along some of the world's axes."""
    which = ["xyz".index(name) for name in axes]
    for (label, flight), color in zip(flights.items(), COLORS):
        series = flight.series
        away = (series["payload_position"] - series["reference_position"])[:, which]
        axis.plot(series["time"], 100 * np.linalg.norm(away, axis=1), color=color, label=label)
    axis.set(title=title, xlabel="time [s]", ylim=(0, None))
    axis.grid(alpha=0.25)
    if len(flights) > 1:
        axis.legend(fontsize=8)


def demonstration_to_flight(names: Names, path: Path) -> None:
    """Draw the skill, the contacts on the scan, and the flight."""
    drawing, axes = figure(10, 3.2, 1, 3)
    contacts = names["contacts"]
    found = contacts_mesh(contacts.query.scan.features_S.p, contacts.solutions[:1])
    for axis, mesh, title in zip(
        axes[0],
        (skill_mesh(names["skill"]), found, flown(names["flight"], 3)),
        ("demonstration", "contact on a scan of another box", "flight"),
        strict=True,
    ):
        show(axis, render(mesh, azimuth=-1.2), title)
    save_figure(drawing, path, dpi=90)


def own_controller(names: Names, path: Path) -> None:
    """Draw the flight of the own controller, and both controllers' errors."""
    drawing, axes = figure(9, 3.2, 1, 2)
    flights = names["flights"]
    show(axes[0, 0], render(flown(flights["above it"], 3), azimuth=-1.3), "above it")
    curves(axes[0, 1], flights, "distance from the reference [cm]")
    save_figure(drawing, path, dpi=90)


def own_cost(names: Names, path: Path) -> None:
    """Draw the refined contacts of all weights, and the point that the cost names."""
    mesh = contacts_mesh(names["contacts"].query.scan.features_S.p, ())
    for solution, color in zip(names["refined"].values(), (RED, ORANGE, GREEN), strict=True):
        p = solution.X_SG.p[0]
        mesh.add_sphere(p, color=color, radius=0.015)
        mesh.add_arrow(p, p + 0.15 * solution.normal[0], color=color, radius=0.006)
    mesh.add_sphere([*names["point"], p[2]], color=BLACK, radius=0.01)
    drawing, axes = figure(6, 3.6)
    title = "red: weight 0; orange: 100; green: 10000; black: the point of the cost"
    show(axes[0, 0], render(mesh, size=(900, 600)), title)
    save_figure(drawing, path, dpi=90)


def camera_in_a_diagram(names: Names, path: Path) -> None:
    """Draw the depth image, the features of the scan in the world, and the contact."""
    drawing, axes = figure(9, 3.2, 1, 2)
    depth = names["image"].data[:, :, 0]
    drawn = axes[0, 0].imshow(np.where(np.isfinite(depth), depth, np.nan))
    drawing.colorbar(drawn, ax=axes[0, 0], label="depth [m]")
    axes[0, 0].set(title="depth image", xlabel="pixel", ylabel="pixel")
    contacts, X_WC = names["contacts"], names["X_WC"]
    X = Pose(X_WC.translation(), X_WC.rotation().ToQuaternion().wxyz())
    mesh = features_mesh(contacts.query.scan.features_S.transformed(X))
    p = X_WC @ contacts.best.X_SG.p[0]
    mesh.add_sphere(p, color=GREEN, radius=0.02)
    mesh.add_arrow(p, p + [0.0, 0.0, 0.2], color=GREEN, radius=0.008)
    show(axes[0, 1], render(mesh, azimuth=-1.3), "features of the scan, and the contact")
    save_figure(drawing, path, dpi=90)


def three_quadrotors(names: Names, path: Path) -> None:
    """Draw the flight, and the tensions over time with those of statics."""
    drawing, axes = figure(9, 3.4, 1, 2)
    show(axes[0, 0], render(flown(names["flight"], 2)), "at the start and at the end")
    series = names["flight"].series
    for k, color in zip(range(3), COLORS):
        label = f"cable {k + 1}"
        axes[0, 1].plot(series["time"], series["tension"][:, k], color=color, lw=0.8, label=label)
        axes[0, 1].axhline(names["expected"][k], color=color, ls=":")
    axes[0, 1].set(title="tension [N]; dotted: statics", xlabel="time [s]", ylim=(0, 6))
    axes[0, 1].legend(fontsize=8)
    save_figure(drawing, path, dpi=90)


def disturbance_observer(names: Names, path: Path) -> None:
    """Draw the flights' ends, and the distance from the reference over time."""
    drawing, axes = figure(9, 3.2, 1, 2)
    flights = {f"{name} observer": flight for name, flight in names["flights"].items()}
    without = flown(flights["without observer"], 2)
    show(axes[0, 0], render(without, azimuth=-1.4), "without observer: start and end")
    curves(axes[0, 1], flights, "distance from the reference [cm]")
    save_figure(drawing, path, dpi=90)


def own_study(names: Names, path: Path) -> None:
    """Take the figure of the contacts from the study's report."""
    (source,) = (names["folder"] / "figures").glob("contacts*.png")
    path.write_bytes(source.read_bytes())


def parts_without_the_station(names: Names, path: Path) -> None:
    """Draw heights and tension over time."""
    drawing, axes = figure(9, 2.8, 1, 2)
    context = names["simulator"].get_context()
    box, quadrotor, tension = (log.FindLog(context) for log in names["logs"])
    for log, label, color in ((quadrotor, "quadrotor", COLORS[0]), (box, "box", COLORS[1])):
        axes[0, 0].plot(log.sample_times(), log.data()[6], color=color, label=label)
    axes[0, 0].set(title="height [m]", xlabel="time [s]", ylim=(0, None))
    axes[0, 0].legend(fontsize=8)
    axes[0, 1].plot(tension.sample_times(), tension.data()[0], color=COLORS[0])
    axes[0, 1].set(title="tension [N]", xlabel="time [s]", ylim=(0, 4))
    save_figure(drawing, path, dpi=90)


def make_small(path: Path) -> None:
    """Reduce a picture to 1000 pixels and a palette of 128 colours."""
    from PIL import Image

    with Image.open(path) as image:
        small = image.convert("RGB")
    small.thumbnail((1000, 1000))
    palette = Image.Quantize.FASTOCTREE
    small.quantize(128, method=palette, dither=Image.Dither.NONE).save(path, optimize=True)


DRAWN: tuple[Callable[[Names, Path], None], ...] = (
    demonstration_to_flight,
    own_controller,
    own_cost,
    camera_in_a_diagram,
    three_quadrotors,
    disturbance_observer,
    own_study,
    parts_without_the_station,
)
"""One function for each example, of the same name."""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="examples (default: all)")
    wanted = parser.parse_args().names
    PICTURES.mkdir(parents=True, exist_ok=True)
    for draw in DRAWN:
        if not wanted or draw.__name__ in wanted:
            print(f"== {draw.__name__}", file=sys.stderr)
            picture = PICTURES / f"{draw.__name__}.png"
            draw(runpy.run_path(str(ROOT / "examples" / f"{draw.__name__}.py")), picture)
            make_small(picture)
            print(f"{picture} ({picture.stat().st_size / 1e3:.0f} kB)")
