"""Draw a Drake diagram: its Graphviz source, or the picture that Graphviz makes of it."""

import shutil
import subprocess
from pathlib import Path

from pydrake.systems.framework import System

from drake_aerial.errors import InputError, JobError, one_line
from drake_aerial.io import files

SOURCES, DRAWINGS = (".dot", ".gv"), (".svg", ".png", ".pdf")
"""Suffixes of the files that can be written; drawings need Graphviz's program `dot`."""


def diagram_source(diagram: System, *, depth: int | None = None) -> str:
    """Return the Graphviz source of a diagram.

    Parameters
    ----------
    diagram : System
        A Drake system, for example a `TransportStation`.
    depth : int, optional
        Number of levels of nested diagrams to draw: 0 draws one box, 1 its parts; all by default.

    Raises
    ------
    InputError
        If the depth is negative.
    """
    if depth is not None and depth < 0:
        raise InputError(f"`depth` must be at least 0, got {depth}")
    return diagram.GetGraphvizString(max_depth=depth)


def write_diagram_picture(path: str | Path, diagram: System, *, depth: int | None = None) -> None:
    """Write a picture of a diagram, in the format of the file's suffix.

    Parameters
    ----------
    path : str or Path
        .dot or .gv for the Graphviz source, .svg, .png or .pdf for a drawing.
    diagram : System
    depth : int, optional
        See `diagram_source`.

    Raises
    ------
    InputError
        If the suffix is another, or a drawing is wanted and `dot` is not installed.
    JobError
        If `dot` fails.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from drake_aerial import Payload, make_transport_station, write_diagram_picture
    >>> box = Payload.from_box([0.4, 0.4, 0.2], 0.25)
    >>> station = make_transport_station(box, [[0.0, 0.0, 0.1]])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_diagram_picture(Path(folder) / "station.dot", station)
    ...     "transport_station" in (Path(folder) / "station.dot").read_text()
    True
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SOURCES + DRAWINGS:
        raise InputError(
            f"a diagram's picture must end in {', '.join(SOURCES + DRAWINGS)}, got {path}"
        )
    source = diagram_source(diagram, depth=depth)
    if suffix in SOURCES:
        files.write_text(path, source)
        return
    # pydot would parse and print the source again before calling the same program.
    program = shutil.which("dot")
    if program is None:
        raise InputError(
            f"{path} needs Graphviz's program dot, which is not installed (Debian: apt-get install "
            f"graphviz); install it, or give a name ending in {' or '.join(SOURCES)}"
        )
    done = subprocess.run(
        [program, f"-T{suffix[1:]}"], input=source.encode(), capture_output=True, check=False
    )
    if done.returncode != 0:
        reason = one_line(done.stderr.decode(errors="replace"))
        raise JobError(f"dot failed to draw {path}: {reason or f'exit code {done.returncode}'}")
    files.write_bytes(path, done.stdout)
