"""Self-contained HTML pages around a `Picture`: they open from disk, on a desk and on a phone."""

from __future__ import annotations

import html
import logging
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.io.files import write_text
from drake_aerial.visualization.flight_scene import set_picture, soften_lights
from drake_aerial.visualization.picture import Color, Picture

_STYLE = """
<style>
  #card { position: fixed; left: 10px; top: 10px; max-width: min(330px, 74vw); z-index: 5; font: 14px/1.4 system-ui, sans-serif;
    background: rgba(255,255,255,.88); color: #1b1f24; border-radius: 8px; padding: 8px 12px; box-shadow: 0 1px 4px rgba(0,0,0,.25); }
  .dg.main { z-index: 2; }
  @media (max-width: 599px) { .dg.main { display: none; } }
  #card summary { font-weight: 600; cursor: pointer; }
  #card ul { list-style: none; padding: 0; margin: 6px 0; }
  #card i { display: inline-block; width: .8em; height: .8em; border-radius: 50%; margin-right: .5em; }
  #card pre { white-space: pre-wrap; margin: 4px 0; font: 12px/1.35 ui-monospace, monospace; max-height: 45vh; overflow: auto; }
</style>
"""
# What fits into a square is cut off on a narrow screen, and covered by an open card; Meshcat looks at the window's size
# before the page is laid out.
_FIT = """
<script>
  function fitToScreen() {
    const pane = document.getElementById('meshcat-pane'), card = document.getElementById('card');
    const width = pane.clientWidth, height = pane.clientHeight;
    const covered = card.open && width > 700 ? card.offsetWidth : 0;
    viewer.camera.setViewOffset(width, height, -covered / 2, 0, width, height);
    viewer.set_property(['Cameras', 'default', 'rotated', '<object>'], 'zoom', Math.min(1, 1.1 * (width - covered) / height));
  }
  addEventListener('resize', fitToScreen);
  document.getElementById('card').addEventListener('toggle', fitToScreen);
  requestAnimationFrame(() => dispatchEvent(new Event('resize')));
</script>
"""


def card(
    title: str, legend: list[tuple[Color, str]], text: str = "", *, is_open: bool = True
) -> str:
    """Return the HTML of a folding card: a title, a legend of (colour, label) pairs, and preformatted text."""
    rows = "".join(
        f'<li><i style="background:{_css(color)}"></i>{html.escape(label)}</li>'
        for color, label in legend
    )
    body = f"<pre>{html.escape(text)}</pre>" if text else ""
    state = " open" if is_open else ""
    return (
        f'{_STYLE}<details id="card"{state}><summary>{html.escape(title)}</summary><ul>{rows}</ul>{body}</details>'
        "<script>if (innerWidth < 600) document.getElementById('card').open = false;</script>"
        f"{_FIT}"
    )


def add_card(page: str, overlay: str, title: str) -> str:
    """Return a Meshcat page with an overlay and a title put in."""
    head = f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{html.escape(title)}</title>'
    page = page.replace("<head>", "<head>" + head, 1)
    before, body, after = page.rpartition("</body>")
    return before + overlay + body + after if body else page + overlay


def write_picture_page(
    path: str | Path,
    picture: Picture,
    *,
    title: str,
    legend: list[tuple[Color, str]],
    text: str = "",
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
    meshcat = quiet_meshcat()
    show_picture(meshcat, picture)
    write_text(path, add_card(meshcat.StaticHtml(), card(title, legend, text), title))


def show_picture(meshcat: Any, picture: Picture) -> None:
    """Put a picture into a Meshcat, lit and seen from where all of it is seen."""
    low, high = picture.bounds()
    center, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)) + 1e-6
    set_picture(meshcat, "picture", picture)
    meshcat.SetProperty("/Background", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    meshcat.SetProperty("/Grid", "visible", False)
    soften_lights(meshcat)
    meshcat.SetCameraPose(center + 1.7 * radius * np.array([0.62, -0.62, 0.48]), center)


def quiet_meshcat(port: int | None = None) -> Any:
    """Return a Meshcat of which Drake's log says nothing; its server stops when nobody refers to it any more.

    Raises
    ------
    InputError
        If the port cannot be had.
    """
    from pydrake.geometry import Meshcat, MeshcatParams

    # Drake ends the process for a port that only the system may have.
    if port is not None and not 1024 <= port <= 65535:
        raise InputError(f"port {port} given; 1024 to 65535 accepted")
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.WARNING)
    try:
        return Meshcat(MeshcatParams(host="localhost", port=port, show_stats_plot=False))
    except RuntimeError as error:
        raise InputError(f"cannot listen on port {port or '7000 to 7999'}: it is taken") from error
    finally:
        log.setLevel(level)


def _css(color: Color) -> str:
    return "#" + "".join(f"{round(255 * c):02x}" for c in color)
