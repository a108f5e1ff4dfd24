"""What a verb says on stdout: one line of JSON for programs, a short summary for people."""

from __future__ import annotations

import json
from typing import Any


def answer(as_json: bool, document: dict[str, Any], text: str) -> None:
    """Print the document as one line of JSON, or the text."""
    print(json.dumps(document) if as_json else text)
