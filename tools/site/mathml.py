"""Sphinx extension: convert formulas to MathML at build time; pages load no renderer."""

import re

from docutils.nodes import SkipNode
from latex2mathml.converter import convert


def _mathml(latex: str, display: str) -> str:
    mathml = convert(latex, display=display)
    # The converter passes commands that it does not know through as text.
    if unknown := re.search(r"\\[a-zA-Z]+", re.sub(r'\w+="[^"]*"', "", mathml)):
        raise ValueError(f"{unknown[0]} is not understood in the formula {latex}")
    return mathml


def _inline(writer, node) -> None:
    writer.body.append(_mathml(node.astext(), "inline"))
    raise SkipNode


def _block(writer, node) -> None:
    writer.body.append(f'<div class="formula">{_mathml(node.astext(), "block")}</div>')
    raise SkipNode


def setup(app):
    """Offer `html_math_renderer = "mathml"`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
