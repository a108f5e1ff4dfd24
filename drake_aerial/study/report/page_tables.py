"""Tables, badges and method names of the report's page."""

from __future__ import annotations

import html
from collections.abc import Sequence

from drake_aerial.study.analysis.quantities import method_color

STYLE = """
h3 { font-size: 1rem; margin-bottom: .3rem; } td, th { vertical-align: top; } td.l, th.l { text-align: left; }
td { font-variant-numeric: tabular-nums; white-space: nowrap; } td.l { white-space: normal; } th { line-height: 1.25; } .wide { margin: .6rem 0; }
.badge { border-radius: 1rem; padding: .05rem .55rem; font-size: .85rem; display: inline-block; }
.yes { background: #dafbe1; color: #0b5324; } .part { background: #fff4c2; color: #6b4400; } .no { background: #ffe3df; color: #8f1322; }
.none { background: #eaeef2; color: #424a53; white-space: nowrap; } .bad { color: #8f1322; font-size: .85rem; }
.method { white-space: nowrap; } .method::before { content: ""; display: inline-block; width: .7em; height: .7em; border-radius: 50%;
margin-right: .35em; background: var(--c); }
details { border: 1px solid #d0d7de; border-radius: 6px; padding: .4rem .8rem; margin: .6rem 0; } summary { cursor: pointer; font-weight: 600; }
figure.small-figure img { width: min(100%, var(--w)); } figure.wide-figure img { max-width: none; width: min(100%, var(--w)); min-width: min(46rem, var(--w)); }
.more { white-space: normal; text-align: left; min-width: 15rem; }
"""


def method_name(method: str) -> str:
    """Return a method's name with its colour."""
    return f'<span class="method" style="--c:{method_color(method)}">{html.escape(method)}</span>'


def badge(word: str) -> str:
    """Return a verdict or a finding as a coloured mark; the word says it without the colour."""
    if word == "holds" or (word.startswith("holds under") and ";" not in word):
        kind, sign = "yes", "✓"
    elif word.startswith("holds") or ";" in word or "holds in" in word:
        kind, sign = "part", "◐"
    elif word == "not tested":
        kind, sign = "none", "–"
    elif word == "undecided":
        kind, sign = "part", "?"
    else:
        kind, sign = "no", "✗"
    return f'<span class="badge {kind}">{sign} {html.escape(word)}</span>'


def table(heads: Sequence[str], rows: Sequence[Sequence[str]], left: int = 1) -> str:
    """Return a table that scrolls by itself on a narrow screen: heads and cells are HTML, the first `left` columns are text."""

    def cells(tag: str, row: Sequence[str]) -> str:
        return "".join(
            f'<{tag} class="l">{c}</{tag}>' if k < left else f"<{tag}>{c}</{tag}>"
            for k, c in enumerate(row)
        )

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="wide"><table><tr>{cells("th", heads)}</tr>{body}</table></div>'
