"""Colour, line style and mark of each method in figures and tables."""

import zlib

# Distinct for all kinds of colour vision (Okabe and Ito).
METHOD_COLORS = {
    "task": "#0072B2",
    "paper": "#009E73",
    "kopicki": "#D55E00",
    "centroid": "#7F7F7F",
    "control": "#CC79A7",
    "registration": "#56B4E9",
    "obb": "#B8A500",
    "head": "#0072B2",
    "middle": "#E69F00",
    "thigh": "#D55E00",
}
# For prints without colour.
METHOD_LINES = {
    "task": "-",
    "paper": "--",
    "kopicki": "-.",
    "centroid": ":",
    "middle": "--",
    "thigh": "-.",
}
METHOD_MARKS = {
    "task": "o",
    "paper": "s",
    "kopicki": "^",
    "centroid": "D",
    "registration": "v",
    "obb": "P",
    "middle": "s",
    "thigh": "^",
}
_OTHER_COLORS = ("#56B4E9", "#E69F00", "#CC79A7", "#B8A500", "#000000")


def method_color(method: str) -> str:
    """Return the colour of a method, or of given contacts by their label."""
    other = _OTHER_COLORS[zlib.crc32(method.encode()) % len(_OTHER_COLORS)]
    return METHOD_COLORS.get(method, other)
