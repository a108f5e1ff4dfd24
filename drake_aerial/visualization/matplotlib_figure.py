"""Matplotlib figures without pyplot, and their files: equal figures give equal bytes."""

from pathlib import Path
from typing import Any

from drake_aerial.io.files import replacing

_PALETTE_COLORS = 256


def figure(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Any, Any]:
    """Return a Matplotlib figure [inches] and its axes, an array (rows, columns)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(drawing)
    return drawing, drawing.subplots(rows, columns, squeeze=False, **options)


def save_figure(drawing: Any, path: str | Path, dpi: int = 130) -> None:
    """Write a figure as PNG, PDF or SVG, by the suffix of the path."""
    path = Path(path)
    # Dates and versions would make the bytes differ.
    metadata = {"pdf": {"CreationDate": None}, "png": {"Software": None}, "svg": {"Date": None}}
    kind = path.suffix.lstrip(".").lower()
    with replacing(path) as temporary:
        drawing.savefig(temporary, dpi=dpi, format=kind, metadata=metadata.get(kind))


def save_png_and_pdf(drawing: Any, stem: Path, dpi: int) -> Path:
    """Write a figure as a small PNG for a page and as a PDF for print; return the PNG's path.

    Parameters
    ----------
    drawing : matplotlib.figure.Figure
    stem : Path
        Path of the files without their endings.
    dpi : int
        Resolution of the PNG.
    """
    from PIL import Image

    png = stem.with_name(stem.name + ".png")
    save_figure(drawing, stem.with_name(stem.name + ".pdf"))
    # Keep the layout; computing it again takes as long as drawing.
    drawing.set_layout_engine("none")
    save_figure(drawing, png, dpi=dpi)
    with Image.open(png) as image:
        # A palette takes a third of the bytes.
        small = image.convert("RGB").quantize(
            _PALETTE_COLORS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE
        )
    with replacing(png) as temporary:
        small.save(temporary, format="PNG", optimize=True)
    return png
