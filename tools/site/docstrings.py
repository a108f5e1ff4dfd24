"""Sphinx extension: rewrite docstrings where reStructuredText would misread them.

Docstrings are written for readers of code. Markdown tables become list-tables, and bars (absolute
values) are escaped.
"""

import re


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in row.strip().strip("|").split("|")]


def _is_row(line: str) -> bool:
    return line.strip().startswith("|") and line.strip().endswith("|") and line.count("|") > 2


def _table(rows: list[str]) -> list[str]:
    """Return a list-table of the rows of a Markdown table whose second row is a rule."""
    lines = [".. list-table::", "   :header-rows: 1", ""]
    for row in [rows[0], *rows[2:]]:
        for number, cell in enumerate(_cells(row)):
            lines.append(f"   {'* -' if number == 0 else '  -'} {cell}")
    return ["", *lines, ""]


def _prose(line: str) -> str:
    """Return the line with bars (absolute values) and stars taken literally outside of `code`."""
    parts = re.split(r"(`[^`]*`)", line)
    return "".join(part if part.startswith("`") else part.replace("|", r"\|") for part in parts)


def rewrite(app, what, name, obj, options, lines: list[str]) -> None:
    """Rewrite one docstring in place, before its sections are read."""
    out: list[str] = []
    rest = list(lines)
    while rest:
        if len(rest) > 1 and _is_row(rest[0]) and set(rest[1].strip()) <= set("|-: "):
            count = next((i for i, line in enumerate(rest) if not _is_row(line)), len(rest))
            out += _table(rest[:count])
            rest = rest[count:]
            continue
        line = rest.pop(0)
        out.append(line if line.lstrip().startswith((">>>", "...")) else _prose(line))
    lines[:] = out


def setup(app):
    """Run before napoleon, which connects with the default priority."""
    app.connect("autodoc-process-docstring", rewrite, priority=100)
    return {"parallel_read_safe": True}
