"""Draw the pictures of docs/gallery.md.

    tools/run python tools/docs_pictures.py [DIR]

They are drawn only if the package, its models or this file have changed.
"""

import argparse
import hashlib
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
PANEL = (480, 400)
STAMP = "drawn-from.txt"


def draw(folder: Path) -> list[Path]:
    """Draw all pictures into a folder, unless they are up to date; return their paths."""
    stamp, wanted = folder / STAMP, _fingerprint()
    if not stamp.is_file() or stamp.read_text() != wanted:
        folder.mkdir(parents=True, exist_ok=True)
        for picture in (features, skills, contacts, likelihood, formation, flights):
            print(f"drawing {picture.__name__}.png", file=sys.stderr)
            picture(folder / f"{picture.__name__}.png")
        stamp.write_text(wanted)
    return sorted(folder.glob("*.png"))


def _fingerprint() -> str:
    digest = hashlib.sha256(Path(__file__).read_bytes())
    for file in sorted([*(ROOT / "drake_aerial").rglob("*.py"), *(ROOT / "models").rglob("*.*")]):
        digest.update(file.relative_to(ROOT).as_posix().encode() + file.read_bytes())
    return digest.hexdigest()


def _sheet(path: Path, images: dict[str, np.ndarray], columns: int) -> None:
    """Write images with their titles side by side."""
    from drake_aerial.visualization.matplotlib_figure import figure, save_figure

    rows = -(-len(images) // columns)
    drawing, axes = figure(3.6 * columns, 3.2 * rows, rows, columns)
    for axis in axes.ravel():
        axis.axis("off")
    for axis, (title, image) in zip(axes.ravel(), images.items()):
        axis.imshow(image)
        axis.set_title(title, fontsize=10)
    save_figure(drawing, path, dpi=110)


def features(path: Path) -> None:
    """Draw surface features of a box, of one camera's view of it, and of a bunny."""
    from drake_aerial import compute_features, read_scan
    from drake_aerial.demo import scan_of
    from drake_aerial.plant.payload import Payload
    from drake_aerial.visualization.method_meshes import features_mesh
    from drake_aerial.visualization.rendering import render

    clouds = {
        "a box, seen from all sides": read_scan("box_68x61x28"),
        "a box, seen by one camera": scan_of(Payload.read("box_68x61x28"), seed=0),
        "a bunny": read_scan("bunny"),
    }
    images = {
        title: render(features_mesh(compute_features(cloud)), size=PANEL)
        for title, cloud in clouds.items()
    }
    _sheet(path, images, 3)


def skills(path: Path) -> None:
    """Draw the skills of four shipped demonstrations."""
    from drake_aerial import read_skill
    from drake_aerial.visualization.method_meshes import skill_mesh
    from drake_aerial.visualization.rendering import render

    names = ("flat", "edge", "curved", "formation")
    _sheet(path, {name: render(skill_mesh(read_skill(name)), size=PANEL) for name in names}, 4)


def contacts(path: Path) -> None:
    """Draw the best contacts of two methods on one camera's view of another box."""
    from drake_aerial import read_skill, transfer
    from drake_aerial.demo import scan_of
    from drake_aerial.plant.payload import Payload
    from drake_aerial.visualization.contacts_figure import draw_contacts

    skill, scan = read_skill("flat"), scan_of(Payload.read("box_68x68x28"), seed=0)
    found = {method: transfer(skill, scan, method=method, top=3) for method in ("task", "kopicki")}
    draw_contacts(path, skill, found["task"].query.scan.features_S.p, found, most=3)


def likelihood(path: Path) -> None:
    """Draw the query density, the density of the votes, and both together on a new scan."""
    from drake_aerial import read_scan, read_skill, transfer
    from drake_aerial.visualization.colors import heat
    from drake_aerial.visualization.method_meshes import contacts_mesh
    from drake_aerial.visualization.rendering import render

    found = transfer(read_skill("curved"), read_scan("bunny"))
    query = found.query
    points = query.scan.features_S.p
    fields = {
        "local shape as demonstrated": query.log_query(0),
        "place on the object as demonstrated": query.log_votes(),
        "both, and the contacts found": query.log_surface(),
    }
    images = {}
    for index, (title, log) in enumerate(fields.items()):
        shown = found.solutions if index == 2 else ()
        mesh = contacts_mesh(points, shown, colors=heat(np.exp(log - log.max())))
        images[title] = render(mesh, size=PANEL, azimuth=-1.2)
    _sheet(path, images, 3)


def formation(path: Path) -> None:
    """Draw three grippers of a triangle on a larger triangle and on a box."""
    from drake_aerial import Payload, PointCloud, read_scan, read_skill, transfer
    from drake_aerial.visualization.method_meshes import contacts_mesh, skill_mesh
    from drake_aerial.visualization.rendering import render

    skill = read_skill("formation")
    large = PointCloud.read(Payload.read("hollow_triangle").to_trimesh().apply_scale(1.4))
    images = {"demonstration": render(skill_mesh(skill), size=PANEL)}
    for title, cloud in {"1.4 times as large": large, "a box": read_scan("box_68x68x28")}.items():
        found = transfer(skill, cloud, top=1)
        images[title] = render(
            contacts_mesh(found.query.scan.features_S.p, found.solutions), size=PANEL
        )
    _sheet(path, images, 3)


def flights(path: Path) -> None:
    """Draw flights of one payload with a contact in the middle and 10 cm beside it."""
    from drake_aerial.plant.payload import Payload
    from drake_aerial.simulation.flight import Flight
    from drake_aerial.simulation.suspended_payload import SuspendedPayload
    from drake_aerial.visualization.flight_plots import plot_flights

    payload = Payload.read("box_68x61x28")
    shown = {}
    for offset in (0.0, 0.1):
        suspension = SuspendedPayload.from_contacts(
            payload, [[offset, 0.0, 0.14]], [[0.0, 0.0, 1.0]]
        )
        shown[f"{100 * offset:.0f} cm off the centre"] = Flight(suspension).run(0)
    plot_flights(shown, path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, help="default: a temporary folder")
    target = parser.parse_args().folder or Path(tempfile.mkdtemp(prefix="docs_pictures_"))
    for drawn in draw(target):
        print(drawn)
