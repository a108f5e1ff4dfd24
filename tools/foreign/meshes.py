"""Meshes by Open3D, trimesh, plyfile and meshio."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
import trimesh

from .cases import BOX, QUADS, TRIANGLES, VERTICES, Case

OTHER_FORMATS = r"accepted formats are"


def open3d_meshes() -> Iterator[Case]:
    """Yield every format and option of Open3D's mesh writer."""
    import open3d as o3d

    for suffix, ascii_, extras in product(
        ("ply", "obj", "stl", "off", "gltf", "glb"), (False, True), ("plain", "normals", "colours")
    ):
        if (suffix == "obj" and not ascii_) or (suffix in ("off", "gltf", "glb") and ascii_):
            continue

        def write(path, ascii_=ascii_, extras=extras):
            mesh = o3d.geometry.TriangleMesh(
                o3d.utility.Vector3dVector(VERTICES), o3d.utility.Vector3iVector(TRIANGLES)
            )
            if extras == "normals" or path.suffix == ".stl":
                mesh.compute_triangle_normals()
                mesh.compute_vertex_normals()
            if extras == "colours":
                mesh.paint_uniform_color([0.2, 0.5, 0.9])
            o3d.io.write_triangle_mesh(str(path), mesh, write_ascii=ascii_)

        name = f"mesh_{'ascii' if ascii_ else 'binary'}_{extras}.{suffix}"
        if suffix == "stl" and ascii_:
            continue  # Open3D does not write it
        yield Case(
            "open3d", name, write, "mesh" if suffix in ("ply", "obj", "stl") else OTHER_FORMATS
        )


def trimesh_meshes() -> Iterator[Case]:
    """Yield every format of trimesh, and its options of PLY and OBJ."""
    for suffix, kind in (
        ("ply", None),
        ("obj", None),
        ("stl", None),
        ("stl", "stl_ascii"),
        ("off", None),
        ("glb", None),
    ):

        def write(path, kind=kind):
            BOX.export(path, file_type=kind or path.suffix[1:])

        holds = "mesh" if suffix in ("ply", "obj", "stl") else OTHER_FORMATS
        yield Case("trimesh", f"mesh_{kind or 'default'}.{suffix}", write, holds)
    for encoding, normals in product(("ascii", "binary"), (False, True)):

        def write(path, encoding=encoding, normals=normals):
            data = trimesh.exchange.ply.export_ply(BOX, encoding=encoding, vertex_normal=normals)
            path.write_bytes(data)

        yield Case("trimesh", f"mesh_{encoding}{'_normals' * normals}.ply", write, "mesh")
    for normals, texture in product((False, True), (False, True)):

        def write(path, normals=normals, texture=texture):
            mesh = BOX.copy()
            if texture:
                from PIL import Image

                image = Image.new("RGB", (4, 4), "red")
                mesh.visual = trimesh.visual.TextureVisuals(uv=VERTICES[:, :2] + 0.5, image=image)
            mesh.export(path, include_normals=normals)

        yield Case(
            "trimesh", f"mesh{'_normals' * normals}{'_texture' * texture}.obj", write, "mesh"
        )


def plyfile_meshes() -> Iterator[Case]:
    """Yield faces with all types of lists, and mixed polygons."""
    from plyfile import PlyData, PlyElement

    for index, length, text, quads in product(
        ("i4", "u4", "u2"), ("u1", "i4"), (False, True), (False, True)
    ):

        def write(path, index=index, length=length, text=text, quads=quads):
            vertices = np.array([tuple(p) for p in VERTICES], [(a, "f8") for a in "xyz"])
            polygons = list(QUADS[:3]) + [q[[0, 1, 2]] for q in QUADS[3:]]
            polygons = polygons + [q[[0, 2, 3]] for q in QUADS[3:]] if quads else list(TRIANGLES)
            faces = np.empty(len(polygons), [("vertex_indices", "O"), ("flags", "i4")])
            faces["vertex_indices"] = [np.asarray(p, index) for p in polygons]
            elements = [
                PlyElement.describe(vertices, "vertex"),
                PlyElement.describe(
                    faces,
                    "face",
                    val_types={"vertex_indices": index},
                    len_types={"vertex_indices": length},
                ),
            ]
            PlyData(elements, text=text).write(str(path))

        parts = ("text" if text else "binary", index, length, "mixed" if quads else "triangles")
        yield Case("plyfile", "_".join(parts) + ".ply", write, "mesh")


def meshio_meshes() -> Iterator[Case]:
    """Yield every surface format of meshio."""
    import meshio

    for suffix, binary, cells in product(
        ("ply", "stl", "obj", "off", "vtk", "vtu"), (False, True), ("triangle", "quad")
    ):
        if (suffix == "stl" and cells == "quad") or (suffix in ("obj", "off") and binary):
            continue
        if suffix == "off" and cells == "quad":
            continue

        def write(path, binary=binary, cells=cells):
            mesh = meshio.Mesh(VERTICES, [(cells, TRIANGLES if cells == "triangle" else QUADS)])
            options = {} if path.suffix in (".obj", ".off") else {"binary": binary}
            mesh.write(str(path), **options)

        holds = "mesh" if suffix in ("ply", "stl", "obj") else OTHER_FORMATS
        name = f"{cells}_{'binary' if binary else 'text'}.{suffix}"
        yield Case("meshio", name, write, holds, 1e-6)
