"""HTML reports that need no other file: templates, filled by Jinja2, and embedded images."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from drake_aerial.io.files import write_text

_HOME = "drake_aerial.visualization"


def fill_template(name: str, values: Mapping[str, Any], *, package: str = _HOME) -> str:
    """Return the text of a template.

    Parameters
    ----------
    name : str
        A file in the folder `templates` of the package.
    values : mapping
        Values and functions, by the names that the template uses.
    package : str
        The template may also extend and include templates of `drake_aerial.visualization`.
    """
    return _environment(package).get_template(name).render(values)


@lru_cache
def _environment(package: str) -> Environment:
    return Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader(_HOME)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


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
