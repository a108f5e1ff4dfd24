"""HTML reports that need no other file: a template, filled with values and embedded images."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_aerial.io.files import write_text
from drake_aerial.visualization.html_templates import fill_template


@dataclass(frozen=True)
class EmbeddedImage:
    """A PNG for the macro `figure` of the templates.

    Attributes
    ----------
    source : str
        Data URI.
    width : int
        [pixels]
    """

    source: str
    width: int

    @classmethod
    def read(cls, path: Path) -> EmbeddedImage:
        """Read a PNG file."""
        data = path.read_bytes()
        encoded = base64.b64encode(data).decode()
        # The width of a PNG is in bytes 16 to 19.
        width = int.from_bytes(data[16:20], "big")
        return cls(f"data:image/png;base64,{encoded}", width)


def write_html_report(
    path: str | Path, template: str, values: Mapping[str, Any], **where: str
) -> None:
    """Write a page from a template that extends report.html; see `fill_template`."""
    write_text(path, fill_template(template, values, **where))
