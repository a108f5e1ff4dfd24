"""The demo's report: one page that a person understands without having read the paper."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_aerial.io.files import write_text

_STYLE = """
body { font: 16px/1.55 system-ui, sans-serif; color: #1b1f24; margin: 0 auto; padding: 1rem; max-width: 62rem; }
h1 { font-size: 1.6rem; line-height: 1.25; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
img { width: 100%; height: auto; } figure { margin: 1rem 0; } figcaption { color: #57606a; font-size: .92rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .95rem; }
th, td { text-align: right; padding: .35rem .6rem; border-bottom: 1px solid #d0d7de; } th:first-child, td:first-child { text-align: left; }
iframe { width: 100%; height: 30rem; border: 1px solid #d0d7de; border-radius: 6px; }
.answer { background: #eef6ff; border-left: 4px solid #1b62c4; padding: .6rem 1rem; border-radius: 4px; }
code, pre { font: .88rem ui-monospace, monospace; background: #f6f8fa; } pre { padding: .7rem; overflow-x: auto; } .muted { color: #57606a; }
"""

# Elements that are not put into a paragraph.
_BLOCKS = ("<pre", "<div", "<iframe", "<figure", "<details", "<h3", "<ul", "<table")

# Key of metrics.json, what it is called here, factor, unit format.
ROWS: tuple[tuple[str, str, float, str], ...] = (
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


@dataclass(frozen=True)
class Section:
    """One section of a report: a heading, paragraphs of HTML, and optionally one image file with a caption."""

    heading: str
    paragraphs: Sequence[str] = ()
    image: Path | None = None
    caption: str = ""


def metrics_table(flights: Mapping[str, Mapping[str, Any]]) -> str:
    """Return an HTML table with one column a flight, from metrics.json documents."""
    head = "".join(f"<th>{html.escape(label)}</th>" for label in flights)
    rows = []
    for key, name, factor, form in ROWS:
        cells = "".join(
            f"<td>{_cell(metrics.get(key), factor, form)}</td>" for metrics in flights.values()
        )
        rows.append(f"<tr><td>{name}</td>{cells}</tr>")
    return f'<div class="wide"><table><tr><th></th>{head}</tr>{"".join(rows)}</table></div>'


def embedded_image(image: Path, caption: str, *, kind: str = "") -> str:
    """Return a PNG as an HTML figure that needs no file beside it; `kind` is the figure's class for the page's style."""
    raw = image.read_bytes()
    data = base64.b64encode(raw).decode()
    text = html.escape(caption)
    label = f' class="{kind}"' if kind else ""
    # A PNG says its width in bytes 16 to 19; none is drawn larger than it is.
    width = int.from_bytes(raw[16:20], "big")
    return (
        f'<figure{label}><div class="wide"><img alt="{text}" style="--w:{width}px" src="data:image/png;base64,{data}"></div>'
        f"<figcaption>{text}</figcaption></figure>"
    )


def write_report(
    path: str | Path, *, title: str, answer: str, sections: Sequence[Section], style: str = ""
) -> None:
    """Write a self-contained page: images are embedded.

    Parameters
    ----------
    path : str or Path
        The page to write.
    title : str
        Plain text.
    answer : str
        What the reader came for, HTML, first on the page.
    sections : sequence of Section
    style : str
        Further CSS.
    """
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{html.escape(title)}</title><style>{_STYLE}{style}</style></head><body>",
        f'<h1>{html.escape(title)}</h1><p class="answer">{answer}</p>',
    ]
    for section in sections:
        parts.append(f"<h2>{html.escape(section.heading)}</h2>")
        parts += [
            text if text.startswith(_BLOCKS) else f"<p>{text}</p>" for text in section.paragraphs
        ]
        if section.image is not None:
            parts.append(embedded_image(section.image, section.caption))
    parts.append("</body></html>\n")
    write_text(path, "\n".join(parts))


def _cell(value: Any, factor: float, form: str) -> str:
    if value is None:
        return "–"
    return html.escape(form.format(value if isinstance(value, str) else factor * value))
