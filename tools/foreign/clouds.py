"""Point clouds by Open3D, trimesh, plyfile, pypcd4, NumPy, laspy and pye57."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
import trimesh

from .cases import COLORS, NORMALS, POINTS, Case

FLOAT32 = POINTS.astype(np.float32).astype(float)


def open3d_clouds() -> Iterator[Case]:
    """Yield every format and option of Open3D's two writers."""
    import open3d as o3d

    for suffix, ascii_, compressed, extras in product(
        ("ply", "pcd"), (False, True), (False, True), ("", "n", "c", "nc")
    ):
        if compressed and (ascii_ or suffix == "ply"):
            continue
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
        if "n" in extras:
            cloud.normals = o3d.utility.Vector3dVector(NORMALS)
        if "c" in extras:
            cloud.colors = o3d.utility.Vector3dVector(COLORS / 255.0)

        def write(path, cloud=cloud, ascii_=ascii_, compressed=compressed):
            o3d.io.write_point_cloud(str(path), cloud, write_ascii=ascii_, compressed=compressed)

        kind = "ascii" if ascii_ else "compressed" if compressed else "binary"
        yield Case("open3d", f"{kind}_{extras or 'plain'}.{suffix}", write, tolerance=2e-6)
    for suffix in ("xyz", "xyzn", "xyzrgb", "pts"):
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS))
        cloud.normals = o3d.utility.Vector3dVector(NORMALS)
        cloud.colors = o3d.utility.Vector3dVector(COLORS / 255.0)

        def write(path, cloud=cloud):
            o3d.io.write_point_cloud(str(path), cloud)

        holds = "points" if suffix in ("xyz", "pts") else r"format '\.xyz"
        yield Case("open3d", f"text.{suffix}", write, holds, 1e-6)
    for suffix, dtype, ascii_ in product(("ply", "pcd"), ("float32", "float64"), (False, True)):

        def write(path, dtype=dtype, ascii_=ascii_):
            cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS.astype(dtype)))
            cloud.point.intensity = o3d.core.Tensor(np.ones((len(POINTS), 1), np.float32))
            o3d.t.io.write_point_cloud(str(path), cloud, write_ascii=ascii_)

        kind = "ascii" if ascii_ else "binary"
        yield Case("open3d", f"tensor_{kind}_{dtype}.{suffix}", write, tolerance=1e-6)


def trimesh_clouds() -> Iterator[Case]:
    """Yield point clouds of trimesh."""
    for suffix, colours in product(("ply", "xyz", "glb"), (False, True)):

        def write(path, colours=colours):
            trimesh.PointCloud(POINTS, colors=COLORS if colours else None).export(path)

        holds = r"format '\.glb'" if suffix == "glb" else "points"
        yield Case("trimesh", f"cloud{'_colours' * colours}.{suffix}", write, holds, 1e-6)
    for encoding in ("ascii", "binary"):

        def write(path, encoding=encoding):
            path.write_bytes(
                trimesh.exchange.ply.export_ply(trimesh.PointCloud(POINTS), encoding=encoding)
            )

        yield Case("trimesh", f"cloud_{encoding}.ply", write, tolerance=1e-6)


def plyfile_clouds() -> Iterator[Case]:
    """Yield vertices of all types, orders and layouts."""
    from plyfile import PlyData, PlyElement

    scales = {"f4": 1.0, "f8": 1.0, "i2": 1000.0, "i4": 1e6, "u2": 1000.0, "i1": 100.0}
    for (kind, scale), text, order in product(scales.items(), (False, True), "<>"):
        values = POINTS * scale if kind[0] == "f" else np.round((POINTS + 0.4) * scale)

        def write(path, kind=kind, text=text, order=order, values=values):
            table = np.zeros(len(values), [("red", "u1"), *((a, kind) for a in "xyz")])
            table["red"] = COLORS[:, 0]
            for k, axis in enumerate("xyz"):
                table[axis] = values[:, k]
            comments = ["written by another library", "element vertex 3"]
            element = PlyElement.describe(table, "vertex")
            PlyData([element], text=text, byte_order=order, comments=comments).write(str(path))

        name = f"{'text' if text else 'binary'}_{'little' if order == '<' else 'big'}_{kind}.ply"
        holds = "points" if kind[0] == "f" else r"large, more than 50 m"
        yield Case("plyfile", name, write, holds, 1e-6)
    for text, where in product((False, True), ("before", "after")):

        def write(path, text=text, where=where):
            table = np.array([tuple(p) for p in POINTS], [(a, "f8") for a in "xyz"])
            lists = np.empty(2, [("weights", "O"), ("id", "i4")])
            lists["weights"] = [np.arange(3, dtype="f4"), np.arange(5, dtype="f4")]
            others = PlyElement.describe(
                lists, "camera", val_types={"weights": "f4"}, len_types={"weights": "u2"}
            )
            elements = [PlyElement.describe(table, "vertex")]
            elements.insert(0 if where == "before" else 1, others)
            PlyData(elements, text=text, obj_info=["scanner 5"]).write(str(path))

        yield Case("plyfile", f"{'text' if text else 'binary'}_list_{where}.ply", write)
    for names in (("X", "Y", "Z"), ("px", "py", "pz"), ("y", "z", "x")):

        def write(path, names=names):
            order = ["xyz".index(name[-1].lower()) for name in names]
            table = np.array([tuple(p) for p in POINTS[:, order]], [(n, "f8") for n in names])
            PlyData([PlyElement.describe(table, "vertex")]).write(str(path))

        yield Case("plyfile", f"names_{''.join(names)}.ply", write)


def pypcd4_clouds() -> Iterator[Case]:
    """Yield all encodings, types and layouts of PCD."""
    from pypcd4 import Encoding, PointCloud
    from pypcd4.pypcd4 import MetaData

    layouts = {
        "xyz": ("x", "y", "z"),
        "intensity_first": ("intensity", "x", "y", "z"),
        "ring_and_time": ("x", "y", "z", "ring", "time"),
        "zyx": ("z", "y", "x"),
    }
    kinds = {"float32": np.float32, "float64": np.float64}
    for (layout, fields), (kind, dtype), encoding in product(
        layouts.items(), kinds.items(), Encoding
    ):

        def write(path, fields=fields, dtype=dtype, encoding=encoding):
            columns = {
                "x": POINTS[:, 0],
                "y": POINTS[:, 1],
                "z": POINTS[:, 2],
                "intensity": COLORS[:, 0],
                "ring": COLORS[:, 1],
                "time": NORMALS[:, 0],
            }
            types = [np.uint16 if name == "ring" else dtype for name in fields]
            arrays = [columns[name].astype(t) for name, t in zip(fields, types, strict=True)]
            cloud = PointCloud.from_points(arrays, fields, types)
            cloud.save(str(path), encoding=encoding)

        name = f"{layout}_{kind}_{encoding.value}.pcd"
        yield Case("pypcd4", name, write, tolerance=1e-6)
    for height in (1, 20):

        def write(path, height=height):
            meta = MetaData.model_validate(
                {
                    "fields": ("x", "y", "z"),
                    "size": (4, 4, 4),
                    "type": ("F", "F", "F"),
                    "count": (1, 1, 1),
                    "points": len(POINTS),
                    "width": len(POINTS) // height,
                    "height": height,
                    "viewpoint": (0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0),
                }
            )
            table = np.array(
                [tuple(p) for p in POINTS.astype(np.float32)], [(a, "f4") for a in "xyz"]
            )
            PointCloud(meta, table).save(str(path))

        yield Case("pypcd4", f"organised_{height}.pcd", write, tolerance=1e-6)


def numpy_clouds() -> Iterator[Case]:
    """Yield arrays and text tables."""
    for delimiter, header, suffix in product(
        (" ", ",", ";", "\t"), ("", "x y z", "# x y z"), ("txt", "csv", "xyz", "asc")
    ):
        if suffix in ("xyz", "asc") and header == "x y z":
            continue

        def write(path, delimiter=delimiter, header=header):
            text = header.replace(" ", delimiter) if header == "x y z" else header
            np.savetxt(path, POINTS, delimiter=delimiter, header=text, comments="", fmt="%.9g")

        mark = {" ": "blank", ",": "comma", ";": "semicolon", "\t": "tab"}[delimiter]
        title = {"": "plain", "x y z": "names", "# x y z": "comment"}[header]
        yield Case("numpy", f"{mark}_{title}.{suffix}", write, tolerance=1e-8)
    arrays = {
        "f4": POINTS.astype("f4"),
        "big": POINTS.astype(">f8"),
        "fortran": np.asfortranarray(POINTS),
        "f2": POINTS.astype("f2"),
        "organised": POINTS.reshape(20, 24, 3),
        "six_columns": np.c_[POINTS, COLORS],
    }
    for name, array in arrays.items():
        coarse = 1e-3 if name == "f2" else 1e-7
        yield Case("numpy", f"{name}.npy", lambda p, a=array: np.save(p, a), tolerance=coarse)
        write = lambda p, a=array: np.savez_compressed(p, points=a)  # noqa: E731
        yield Case("numpy", f"{name}.npz", write, tolerance=coarse)
    yield Case("numpy", "none.npz", lambda p: np.savez(p, xyz=POINTS), "no array named 'points'")
    yield Case("numpy", "columns_2.npy", lambda p: np.save(p, POINTS[:, :2]), "shape")
    yield Case("numpy", "complex.npy", lambda p: np.save(p, POINTS + 1j), "real numbers|complex")


def lidar_files() -> Iterator[Case]:
    """Yield LAS of all point formats, LAZ, and E57 with several scans."""
    import laspy

    for version, number, suffix in (
        *(("1.2", number, "las") for number in range(4)),
        *(("1.3", number, "las") for number in (4, 5)),
        *(("1.4", number, "las") for number in range(6, 11)),
        *(("1.2", number, "laz") for number in (0, 1, 2, 3)),
        *(("1.4", number, "laz") for number in (6, 7)),
    ):

        def write(path, version=version, number=number):
            header = laspy.LasHeader(point_format=number, version=version)
            header.offsets, header.scales = [10.0, -3.0, 0.0], [1e-4, 1e-4, 1e-3]
            cloud = laspy.LasData(header)
            cloud.x, cloud.y, cloud.z = POINTS.T
            cloud.write(str(path))

        yield Case("laspy", f"v{version[2]}_format{number}.{suffix}", write, tolerance=6e-4)
    for scans, fields in product((1, 2), ("xyz", "intensity", "rgb")):

        def write(path, scans=scans, fields=fields):
            import pye57

            file = pye57.E57(str(path), mode="w")
            for part in np.array_split(np.arange(len(POINTS)), scans):
                data = {f"cartesian{a}": POINTS[part, k] for k, a in enumerate("XYZ")}
                if fields == "intensity":
                    data["intensity"] = NORMALS[part, 0]
                if fields == "rgb":
                    for k, colour in enumerate(("Red", "Green", "Blue")):
                        data[f"color{colour}"] = COLORS[part, k]
                file.write_scan_raw(
                    data, rotation=np.array([1.0, 0, 0, 0]), translation=np.zeros(3)
                )
            file.close()

        yield Case("pye57", f"{scans}_scans_{fields}.e57", write)
