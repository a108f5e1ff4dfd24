"""A report's figure as files: a small PNG for the page, a PDF for print; the same figure gives the same bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drake_aerial.io.files import replacing
from drake_aerial.visualization.plots import save_figure

FIGURES = "figures"
_COLORS = 256


def save_figures(drawing: Any, stem: Path, dpi: int) -> Path:
    """Write a Matplotlib figure as `stem`.pdf and `stem`.png, the latter with a palette, and return the PNG's path.

    Parameters
    ----------
    drawing : matplotlib.figure.Figure
        What to write.
    stem : Path
        Without an ending.
    dpi : int
        Of the PNG.
    """
    from PIL import Image

    png = stem.with_name(stem.name + ".png")
    save_figure(drawing, stem.with_name(stem.name + ".pdf"))
    # The layout stands; to work it out again would take as long as drawing.
    drawing.set_layout_engine("none")
    save_figure(drawing, png, dpi=dpi)
    with Image.open(png) as image:
        # Few colours are in use: a palette takes a third of the bytes.
        small = image.convert("RGB").quantize(
            _COLORS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
        )
    with replacing(png) as temporary:
        small.save(temporary, format="PNG", optimize=True)
    return png
