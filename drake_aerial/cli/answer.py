"""What a verb says on stdout: one line of JSON for programs, a short summary for people."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from typing import Any


def tell_assumptions(assumptions: Iterable[object]) -> None:
    """Print what was assumed about a scan on stderr, one line each."""
    for assumption in assumptions:
        print(f"assumed {assumption}", file=sys.stderr)


def answer(as_json: bool, document: dict[str, Any], text: str) -> None:
    """Print the document as one line of JSON, or the text."""
    print(json.dumps(document) if as_json else text)
