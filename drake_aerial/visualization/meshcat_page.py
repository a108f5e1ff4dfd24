"""A Meshcat: its server, and self-contained HTML pages with a card of title, legend and text."""

import html
import logging
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.io.files import write_text
from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import Color
from drake_aerial.visualization.html_report import fill_template


def start_meshcat(port: int | None = None) -> Any:
    """Return a Meshcat; its server stops when the last reference to it is gone.

    Parameters
    ----------
    port : int, optional
        1024 to 65535; the first free one from 7000 by default.

    Raises
    ------
    InputError
        If the port is out of range or taken.
    """
    from pydrake.geometry import Meshcat, MeshcatParams

    # Drake ends the process for a port that is reserved for the system.
    if port is not None and not 1024 <= port <= 65535:
        raise InputError(f"`port` must be in 1024 to 65535, got {port}")
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.WARNING)
    try:
        return Meshcat(MeshcatParams(host="localhost", port=port, show_stats_plot=False))
    except RuntimeError as error:
        where = "every port from 7000 to 7999" if port is None else f"port {port}"
        raise InputError(f"{where} is taken; give another `port`") from error
    finally:
        log.setLevel(level)


def set_mesh(meshcat: Any, name: str, mesh: ColoredMesh) -> None:
    """Put a mesh into a Meshcat under a name; do nothing if it is empty."""
    if len(mesh.vertices):
        meshcat.SetObject(name, mesh.to_drake())


def show_mesh(meshcat: Any, mesh: ColoredMesh) -> None:
    """Put one mesh into a Meshcat, lit, with the camera where all of it is in view."""
    low, high = mesh.bounds()
    center, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)) + 1e-6
    set_mesh(meshcat, "mesh", mesh)
    for name in ("/Background", "/Axes", "/Grid"):
        meshcat.SetProperty(name, "visible", False)
    soften_lights(meshcat)
    meshcat.SetCameraPose(center + 1.7 * radius * np.array([0.62, -0.62, 0.48]), center)


def soften_lights(meshcat: Any) -> None:
    """Reduce Meshcat's own lights, which wash out matt colours."""
    for light, intensity in (
        ("AmbientLight", 0.45),
        ("FillLight", 0.25),
        ("PointLightPositiveX", 0.25),
    ):
        meshcat.SetProperty(f"/Lights/{light}/<object>", "intensity", intensity)


Legend = list[tuple[Color, str]]


def write_meshcat_page(
    path: str | Path,
    meshcat: Any,
    *,
    title: str,
    legend: Legend,
    text: str = "",
    overlay: str = "",
) -> None:
    """Write a Meshcat as one HTML file that can be turned, zoomed and moved.

    Parameters
    ----------
    path : str or Path
        The page; it appears when it is complete.
    meshcat : pydrake.geometry.Meshcat
    title : str
        Of the page and of the folding card in its corner.
    legend : list of (colour, label)
        Listed on the card.
    text : str
        Preformatted, on the card.
    overlay : str
        Further HTML.
    """
    write_text(path, add_overlay(meshcat.StaticHtml(), card(title, legend, text) + overlay, title))


def card(title: str, legend: Legend, text: str = "") -> str:
    """Return the HTML of the collapsible card."""
    rows = [(_css(color), label) for color, label in legend]
    return fill_template("meshcat_card.html", {"title": title, "legend": rows, "text": text})


def add_overlay(page: str, overlay: str, title: str) -> str:
    """Return a Meshcat page with HTML before the end of its body, and with a title."""
    head = (
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title>"
    )
    page = page.replace("<head>", "<head>" + head, 1)
    before, body, after = page.rpartition("</body>")
    return before + overlay + body + after if body else page + overlay


def _css(color: Color) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in color)
