#!/usr/bin/env python3
"""Print on one page what a reader of the package sees: docstrings, help texts, error messages.

    tools/run python tools/words.py > words.md

First docstring lines of all modules, public classes and functions; the help of every command; and
the text of every error and warning, with `{...}` for values. Read the page from top to bottom, and
note each line that is not clear at first sight.
"""

from __future__ import annotations

import ast
import contextlib
import io
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "drake_aerial"
RAISED = ("InputError", "JobError", "ValueError", "TypeError", "RuntimeError", "warn")


def first_lines(tree: ast.Module, module: str) -> Iterator[str]:
    """Yield the first docstring lines of a module and its public definitions."""

    def walk(node: ast.AST, prefix: str) -> Iterator[str]:
        text = ast.get_docstring(node) if hasattr(node, "body") else None
        if text:
            yield f"`{prefix}` {text.splitlines()[0]}"
        for child in ast.iter_child_nodes(node):
            if isinstance(child, (ast.FunctionDef, ast.ClassDef)) and child.name[0] != "_":
                yield from walk(child, f"{prefix}.{child.name}")

    yield from walk(tree, module)


def text_of(node: ast.AST) -> str:
    """Return a string expression's text, values as `{...}`."""
    if isinstance(node, ast.Constant):
        return str(node.value) if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(text_of(part) for part in node.values)
    if isinstance(node, ast.FormattedValue):
        return f"{{{ast.unparse(node.value)}}}"
    if isinstance(node, ast.BinOp):
        return text_of(node.left) + text_of(node.right)
    return f"{{{ast.unparse(node)}}}"


def messages(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield line and text of the errors and warnings that a module makes."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not node.args:
            continue
        name = (
            node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        )
        if name in RAISED:
            yield node.lineno, text_of(node.args[0])


def helps() -> Iterator[str]:
    """Yield the help of the command line and of each command."""
    sys.path.insert(0, str(ROOT))
    from drake_aerial.cli import COMMANDS, main

    for command in ("", *(module.__name__.rpartition(".")[2] for module in COMMANDS)):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
            main([command, "--help"] if command else ["--help"])
        yield out.getvalue()


def main() -> None:
    """Print the page."""
    trees = {path: ast.parse(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}
    print("# First docstring lines\n")
    for path, tree in trees.items():
        module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        print("\n".join(first_lines(tree, module)), end="\n\n")
    print("# Help\n")
    for text in helps():
        print(f"```\n{text}```\n")
    print("# Errors and warnings\n")
    for path, tree in trees.items():
        for line, text in sorted(messages(tree)):
            print(f"`{path.relative_to(PACKAGE)}:{line}` {text}")


if __name__ == "__main__":
    main()
