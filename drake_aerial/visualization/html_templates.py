"""The HTML templates of the pages, filled by Jinja2; values are escaped."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

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
