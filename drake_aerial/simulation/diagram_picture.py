"""A Drake diagram as a picture: its Graphviz source, or the drawing that Graphviz makes of it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from pydrake.systems.framework import System

from drake_aerial.errors import InputError, JobError
from drake_aerial.io import files

SOURCES, DRAWINGS = (".dot", ".gv"), (".svg", ".png", ".pdf")
"""Suffixes of what can be written: the source always, drawings where Graphviz's program `dot` is installed."""


def diagram_source(diagram: System, *, depth: int | None = None) -> str:
    """Return the Graphviz source of a diagram.

    Parameters
    ----------
    diagram : System
        Of Drake, for example a `TransportStation`.
    depth : int, optional
        How many levels of diagrams within diagrams are opened: 0 draws one box, 1 its parts; all of them by default.

    Raises
    ------
    InputError
        For a negative depth.
    """
    if depth is not None and depth < 0:
        raise InputError(f"a depth of {depth} given; 0 or more accepted")
    return diagram.GetGraphvizString(max_depth=depth)


def write_diagram_picture(path: str | Path, diagram: System, *, depth: int | None = None) -> None:
    """Write a picture of a diagram, in the format of the file's suffix.

    Parameters
    ----------
    path : str or Path
        Ends in .dot or .gv for the Graphviz source, in .svg, .png or .pdf for a drawing.
    diagram : System
    depth : int, optional
        As of `diagram_source`.

    Raises
    ------
    InputError
        For another suffix; for a drawing where `dot` is not installed.
    JobError
        If `dot` fails.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from drake_aerial import Payload, make_transport_station, write_diagram_picture
    >>> station = make_transport_station(Payload.from_box([0.4, 0.4, 0.2], 0.25), [[0.0, 0.0, 0.1]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_diagram_picture(Path(folder) / "station.dot", station)
    ...     "transport_station" in (Path(folder) / "station.dot").read_text()
    True
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SOURCES + DRAWINGS:
        raise InputError(
            f"a picture of a diagram named {path}; a name ending in {', '.join(SOURCES + DRAWINGS)} accepted"
        )
    source = diagram_source(diagram, depth=depth)
    if suffix in SOURCES:
        files.write_text(path, source)
        return
    # Called itself, not through pydot, which would parse the source and print it again before it calls the same program.
    program = shutil.which("dot")
    if program is None:
        raise InputError(
            f"{path} needs Graphviz's program dot, which is not installed (Debian: apt-get install graphviz); "
            f"without it a name ending in {' or '.join(SOURCES)} is accepted"
        )
    done = subprocess.run(
        [program, f"-T{suffix[1:]}"], input=source.encode(), capture_output=True, check=False
    )
    if done.returncode != 0:
        reason = " ".join(done.stderr.decode(errors="replace").split())[:200]
        raise JobError(f"dot could not draw {path}: {reason or f'it ended with {done.returncode}'}")
    files.write_bytes(path, done.stdout)
