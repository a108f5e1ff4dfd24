"""Read the vertices and faces of OBJ files; materials, textures and groups are ignored.

Written here because trimesh resolves relative indices against the last vertex of the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drake_aerial.cloud.polygons import triangulate
from drake_aerial.cloud.raw_geometry import RawGeometry, invalid
from drake_aerial.errors import InputError


def read_obj(path: Path) -> RawGeometry:
    """Return the points and triangles of an OBJ file.

    Raises
    ------
    InputError
        If the file is not a valid OBJ file, or has no vertices.
    """
    vertices: list[list[float]] = []
    counts: list[int] = []
    corners: list[int] = []
    text = path.read_bytes().decode("latin-1").replace("\\\r\n", " ").replace("\\\n", " ")
    statements = 0
    for number, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            if words[0] == "v":
                vertices.append([float(words[1]), float(words[2]), float(words[3])])
            elif words[0] in ("f", "fo"):
                # A negative index counts back from the vertices read so far.
                face = [int(word.split("/", 1)[0]) for word in words[1:]]
                corners += [i - 1 if i > 0 else len(vertices) + i for i in face]
                counts.append(len(face))
                if 0 in face:
                    raise ValueError("a face refers to vertex 0; the first one is 1")
        except (ValueError, IndexError) as error:
            why = str(error) if isinstance(error, ValueError) else "too few numbers"
            raise invalid(path, f"line {number} ({line.strip()[:40]!r}): {why}") from error
        statements += words[0] in (
            "v",
            "vt",
            "vn",
            "vp",
            "f",
            "l",
            "p",
            "o",
            "g",
            "usemtl",
            "mtllib",
        )
    if not vertices:
        if statements or path.stat().st_size == 0:
            raise InputError(f"{path} holds no points")
        raise invalid(path, "no line begins with 'v'")
    points = np.array(vertices)
    indices = np.array(corners, dtype=np.int64)
    if len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        wrong = indices.max() + 1 if indices.min() >= 0 else indices.min()
        raise invalid(path, f"a face refers to vertex {wrong} of {len(points)}")
    faces = triangulate(points, np.array(counts, dtype=np.int64), indices)
    return RawGeometry(points, faces, str(path), str(path))
