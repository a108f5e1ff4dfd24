"""Self-contained HTML pages around a `Picture`: they open from disk, on a desk and on a phone."""

from __future__ import annotations

import html
import tempfile
from pathlib import Path

import numpy as np

from drake_aerial.drawing.picture import Color, Picture
from drake_aerial.drawing.rendering import write_gltf
from drake_aerial.files import write_text

_STYLE = """
<style>
  #card { position: fixed; left: 10px; top: 10px; max-width: min(330px, 74vw); z-index: 5; font: 14px/1.4 system-ui, sans-serif;
    background: rgba(255,255,255,.88); color: #1b1f24; border-radius: 8px; padding: 8px 12px; box-shadow: 0 1px 4px rgba(0,0,0,.25); }
  #card summary { font-weight: 600; cursor: pointer; }
  #card ul { list-style: none; padding: 0; margin: 6px 0; }
  #card i { display: inline-block; width: .8em; height: .8em; border-radius: 50%; margin-right: .5em; }
  #card pre { white-space: pre-wrap; margin: 4px 0; font: 12px/1.35 ui-monospace, monospace; max-height: 45vh; overflow: auto; }
</style>
"""


def card(title: str, legend: list[tuple[Color, str]], text: str = "", *, is_open: bool = True) -> str:
    """Return the HTML of a folding card: a title, a legend of (colour, label) pairs, and preformatted text."""
    rows = "".join(f'<li><i style="background:{_css(color)}"></i>{html.escape(label)}</li>' for color, label in legend)
    body = f"<pre>{html.escape(text)}</pre>" if text else ""
    state = " open" if is_open else ""
    return (
        f'{_STYLE}<details id="card"{state}><summary>{html.escape(title)}</summary><ul>{rows}</ul>{body}</details>'
        "<script>if (innerWidth < 600) document.getElementById('card').open = false;</script>"
    )


def add_card(page: str, overlay: str, title: str) -> str:
    """Return a Meshcat page with an overlay and a title put in."""
    head = f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{html.escape(title)}</title>'
    page = page.replace("<head>", "<head>" + head, 1)
    before, body, after = page.rpartition("</body>")
    return before + overlay + body + after if body else page + overlay


def write_picture_page(
    path: str | Path, picture: Picture, *, title: str, legend: list[tuple[Color, str]], text: str = ""
) -> None:
    """Write one HTML page that shows a picture which can be turned, zoomed and moved.

    Parameters
    ----------
    path : str or Path
        The page to write; it is put in place when it is whole.
    picture : Picture
        What is shown; z is up.
    title, legend, text
        What the folding card in the corner says: legend is a list of (colour, label) pairs.
    """
    from pydrake.geometry import Mesh, Meshcat, MeshcatParams

    low, high = picture.bounds()
    center, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)) + 1e-6
    meshcat = Meshcat(MeshcatParams(show_stats_plot=False))
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "picture.gltf"
        write_gltf(picture, model)
        meshcat.SetObject("picture", Mesh(str(model)))
        meshcat.SetProperty("/Background", "visible", False)
        meshcat.SetProperty("/Axes", "visible", False)
        meshcat.SetProperty("/Grid", "visible", False)
        # Meshcat's own lights wash out matt colours.
        meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", 0.45)
        meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", 0.25)
        meshcat.SetProperty("/Lights/PointLightPositiveX/<object>", "intensity", 0.25)
        direction = np.array([0.62, -0.62, 0.48])
        meshcat.SetCameraPose(center + 1.7 * radius * direction, center)
        page = meshcat.StaticHtml()
    write_text(path, add_card(page, card(title, legend, text), title))


def _css(color: Color) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in color)
