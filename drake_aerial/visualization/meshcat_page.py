"""Self-contained HTML pages of a Meshcat, with a card of title, legend and text."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from drake_aerial.io.files import write_text
from drake_aerial.visualization.colors import Color
from drake_aerial.visualization.html_templates import fill_template

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
