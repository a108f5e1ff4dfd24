"""Small faults of a module's text: every change of one expression or statement that `mutants.py` draws from."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SWAPS = {
    **{ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Mod: ("%", "*")},
    **{ast.FloorDiv: ("//", "*"), ast.Pow: ("**", "*"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&")},
    **{ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"), ast.Eq: ("==", "!=")},
    **{ast.NotEq: ("!=", "=="), ast.And: ("and", "or"), ast.Or: ("or", "and"), ast.Is: ("is", "is not")},
    **{ast.IsNot: ("is not", "is")},
}
BOUNDARIES = {ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">")}
PAIRS = (
    "sin cos, max min, maximum minimum, argmax argmin, any all, floor ceil, zeros ones, zeros_like ones_like, sum mean"
)
COUNTERPARTS = {a: b for pair in PAIRS.split(", ") for a, b in (pair.split(), pair.split()[::-1])}
# Functions that are left out, so that their first argument remains, and the arguments that others exchange.
LEFT_OUT = {"abs", "sqrt", "swapaxes", "copy", "sort", "log", "exp", "ravel"}
EXCHANGED = {"cross": (0, 1), "arctan2": (0, 1), "where": (1, 2), "quat_multiply": (0, 1)}
# No faults are looked for in messages.
SKIPPED_FIELDS, SKIPPED = ("annotation", "returns", "decorator_list"), ast.Raise | ast.JoinedStr | ast.expr_context


@dataclass(frozen=True)
class Mutant:
    """One change of a module: the lines it touches before and after, and the module's whole text with it."""

    module: str
    line: int
    before: str
    after: str
    text: str

    def __str__(self) -> str:
        return f"{self.module}:{self.line}: {self.before}  ->  {self.after}"

    @property
    def name(self) -> str:
        """What it is called, wherever its line moves to."""
        return f"{self.module}: {self.before}  ->  {self.after}"


class Text:
    """A module's text by the places of its syntax tree's nodes, which count in bytes."""

    def __init__(self, module: str, text: str):
        self.module, self.bytes, self.tree = module, text.encode(), ast.parse(text)
        self.starts = np.cumsum([0] + [len(line) for line in self.bytes.splitlines(keepends=True)])

    def span(self, node: ast.AST) -> tuple[int, int]:
        """Return where a node begins and ends."""
        begin = self.starts[node.lineno - 1] + node.col_offset
        return int(begin), int(self.starts[node.end_lineno - 1] + node.end_col_offset)

    def of(self, node: ast.AST) -> str:
        """Return a node's text."""
        return self.bytes[slice(*self.span(node))].decode()

    def changed(self, begin: int, end: int, by: str) -> Mutant:
        """Return the text with [begin, end) replaced."""
        line = int(np.searchsorted(self.starts, begin, side="right"))
        first, last = self.starts[line - 1], self.bytes.find(b"\n", end)
        shown = [self.bytes[first:begin] + part + self.bytes[end:last] for part in (self.bytes[begin:end], by.encode())]
        before, after = (" ".join(part.decode().split()) for part in shown)
        return Mutant(self.module, line, before, after, (self.bytes[:begin] + by.encode() + self.bytes[end:]).decode())


def mutants_of(module: str, path: Path) -> list[Mutant]:
    """Return all mutants of the module that `path` holds, each once."""
    text = Text(module, path.read_text())
    found = (text.changed(*change) for node in walk(text.tree) for change in changes(text, node))
    return list({mutant.text: mutant for mutant in found}.values())


def walk(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below one, in order, without annotations, decorators, messages and aliases of types."""
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            alias = isinstance(node, ast.Module) and isinstance(getattr(child, "value", None), ast.BinOp)
            if isinstance(child, ast.AST) and not (name in SKIPPED_FIELDS or isinstance(child, SKIPPED) or alias):
                yield child
                yield from walk(child)


def changes(text: Text, node: ast.AST) -> Iterator[tuple[int, int, str]]:
    """Yield the changes of one node: the part of the text, and what takes its place."""

    def operator(left: ast.AST, kind: ast.AST, right: ast.AST, table: dict) -> Iterator[tuple[int, int, str]]:
        old, new = table.get(type(kind), ("", ""))
        at = text.bytes.find(old.encode(), text.span(left)[1], text.span(right)[0])
        if old and at >= 0:
            yield at, at + len(old), new

    match node:
        case ast.BinOp(left, kind, right):
            yield from operator(left, kind, right, SWAPS)
            if isinstance(kind, ast.MatMult) and text.of(left) != text.of(right):
                yield *text.span(node), f"(({text.of(right)}) @ ({text.of(left)}))"
        case ast.AugAssign(target, kind, value):
            yield from operator(target, kind, value, SWAPS)
            yield *text.span(node), "pass"
        case ast.Compare(left, kinds, right):
            for a, kind, b in zip([left, *right], kinds, right):
                yield from operator(a, kind, b, SWAPS)
                yield from operator(a, kind, b, BOUNDARIES)
        case ast.BoolOp(kind, values):
            for a, b in itertools.pairwise(values):
                yield from operator(a, kind, b, SWAPS)
        case ast.UnaryOp(_, operand):
            yield *text.span(node), f"({text.of(operand)})"
        case ast.Constant(bool(value)):
            yield *text.span(node), repr(not value)
        case ast.Constant(int(value)):
            for other in (value + 1, value - 1) if value > 0 else (1,):
                yield *text.span(node), repr(other)
        case ast.Constant(float(value)):
            # Of a guard against rounding: whether there is a case that needs it.
            yield *text.span(node), repr(0.0 if 0.0 < value < 1e-6 else 2.0 * value if value else 1.0)
        case ast.Call(function, arguments):
            method = isinstance(function, ast.Attribute)
            called, end = function.attr if method else getattr(function, "id", ""), text.span(function)[1]
            if called in COUNTERPARTS and (called != "sum" or method):
                yield end - len(called), end, COUNTERPARTS[called]
            if called in EXCHANGED and len(arguments) > EXCHANGED[called][1]:
                (begin, a), (b, end) = (text.span(arguments[k]) for k in EXCHANGED[called])
                first, second = (text.of(arguments[k]) for k in EXCHANGED[called])
                yield begin, end, second + text.bytes[a:b].decode() + first
            if called in LEFT_OUT and (arguments or method):
                yield *text.span(node), f"({text.of(arguments[0] if arguments else function.value)})"
        case ast.Attribute(value, "T"):
            yield *text.span(node), text.of(value)
        case ast.Assign([ast.Subscript(), *_]) | ast.Expr(ast.Call()):
            yield *text.span(node), "pass"
        case ast.If() | ast.IfExp() | ast.While() if not isinstance(node.test, ast.Name | ast.UnaryOp):
            yield *text.span(node.test), f"not ({text.of(node.test)})"
