#!/usr/bin/env python3
"""Features of point clouds: time, accuracy and memory, also of libigl, PyMeshLab and Open3D.

`target`: a scan of 100,000 points of a box. Features are computed with the defaults (one per voxel
of 7.5 mm) and at every point (50 neighbours each), with one core and with all.

`peers`: clouds of 100,000 points on a sphere, a cylinder and a torus, exact and with 0.5 mm of
noise. For curvatures, libigl and MeshLab get a mesh of the same points, which our features do not
use. MeshLab and Open3D also compute normals of the bare cloud. All neighbourhoods have about 50
points (libigl: four rings, 60 points; MeshLab's quadric: one ring). Curvature errors are relative
to the larger curvature, normal errors are in degrees; both are given as median and 95th
percentile. The ends of the cylinder do not count.

`growth`: 10,000 to 2,000,000 points on one box, with features at every point. rho falls so that
each point has 50 neighbours.

    tools/run python tools/bench/clouds.py                  all; installs peers in a temporary venv
    tools/run python tools/bench/clouds.py --parts target   one part
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

PARTS = ("target", "peers", "growth")
PACKAGES = ["libigl==2.6.3", "pymeshlab==2025.7.post1", "scipy"]
POINTS, NEIGHBOURS, WANTED = 100_000, 50, 0.5
SIZE = np.array([0.68, 0.61, 0.28])
SIZES = (10_000, 30_000, 100_000, 300_000, 1_000_000, 2_000_000)

Faces = np.ndarray
Surface = tuple[np.ndarray, Faces, np.ndarray, np.ndarray, np.ndarray, float]
Answer = tuple[np.ndarray | None, np.ndarray | None]


def box(count: int, noise: float, rng: np.random.Generator) -> np.ndarray:
    """Return points (N, 3) drawn uniformly from a box's faces; `noise` is in m."""
    sides = [(axis, sign) for axis in range(3) for sign in (-0.5, 0.5)]
    area = np.array([np.prod(np.delete(SIZE, axis)) for axis, _ in sides])
    face = rng.choice(6, count, p=area / area.sum())
    points = (rng.random((count, 3)) - 0.5) * SIZE
    for k, (axis, sign) in enumerate(sides):
        points[face == k, axis] = sign * SIZE[axis]
    return points + noise * rng.standard_normal((count, 3))


def radius_of(area: float, count: int) -> float:
    """Return the radius [m] of balls that hold about 50 of `count` points on `area` [m^2]."""
    return float(np.sqrt(NEIGHBOURS * area / (np.pi * count)))


# A surface is a tuple: points, triangles, unit normals, curvatures (larger first, convex positive),
# mask of the points that count, area.


def sphere(count: int, rng: np.random.Generator) -> Surface:
    """A ball of 20 cm radius."""
    from scipy.spatial import ConvexHull

    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    normals = np.column_stack(
        [np.sqrt(1.0 - z * z) * np.cos(angle), np.sqrt(1.0 - z * z) * np.sin(angle), z]
    )
    normals += 0.25 * np.sqrt(4.0 * np.pi / count) * rng.uniform(-1.0, 1.0, normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = ConvexHull(normals).simplices.astype(np.int64)
    a, b, c = (normals[faces[:, k]] for k in range(3))
    inwards = np.sum(np.cross(b - a, c - a) * a, axis=1) < 0.0
    faces[inwards] = faces[inwards][:, ::-1]
    return (
        0.2 * normals,
        faces,
        normals,
        np.full((count, 2), 5.0),
        np.ones(count, bool),
        4.0 * np.pi * 0.2**2,
    )


def grid(rows: int, columns: int, closed: bool) -> Faces:
    """Return the triangles of a grid whose columns are closed, and whose rows may be."""
    i, j = np.meshgrid(np.arange(rows if closed else rows - 1), np.arange(columns), indexing="ij")
    at = lambda a, b: (a % rows) * columns + b % columns  # noqa: E731
    first = np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1)], axis=-1)
    second = np.stack([at(i, j), at(i + 1, j + 1), at(i, j + 1)], axis=-1)
    return np.vstack([first.reshape(-1, 3), second.reshape(-1, 3)])


def cylinder(count: int, rng: np.random.Generator) -> Surface:
    """An upright pipe of 15 cm radius and 50 cm length, open at its ends."""
    R, length = 0.15, 0.5
    step = np.sqrt(2.0 * np.pi * R * length / count)
    rows, columns = round(length / step), round(2.0 * np.pi * R / step)
    z = (np.arange(rows)[:, None] + rng.uniform(-0.25, 0.25, (rows, columns))) * step - 0.5 * length
    angle = (np.arange(columns) + rng.uniform(-0.25, 0.25, (rows, columns))) * 2.0 * np.pi / columns
    normals = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1).reshape(-1, 3)
    points = R * normals
    points[:, 2] = z.ravel()
    area = 2.0 * np.pi * R * length
    inner = np.abs(points[:, 2]) < 0.5 * length - 3.0 * radius_of(area, count)
    return (
        points,
        grid(rows, columns, False)[:, ::-1],
        normals,
        np.tile([1.0 / R, 0.0], (len(points), 1)),
        inner,
        area,
    )


def torus(count: int, rng: np.random.Generator) -> Surface:
    """A ring of 25 cm radius, 8 cm thick on every side of its middle."""
    R, r = 0.25, 0.08
    area = 4.0 * np.pi**2 * R * r
    step = np.sqrt(area / count)
    rows, columns = round(2.0 * np.pi * R / step), round(2.0 * np.pi * r / step)
    u = (
        (np.arange(rows)[:, None] + rng.uniform(-0.25, 0.25, (rows, columns))).ravel()
        * 2.0
        * np.pi
        / rows
    )
    v = (
        (np.arange(columns) + rng.uniform(-0.25, 0.25, (rows, columns))).ravel()
        * 2.0
        * np.pi
        / columns
    )
    normals = np.column_stack([np.cos(u) * np.cos(v), np.sin(u) * np.cos(v), np.sin(v)])
    points = r * normals + R * np.column_stack([np.cos(u), np.sin(u), np.zeros_like(u)])
    kappa = np.column_stack([np.full(len(u), 1.0 / r), np.cos(v) / (R + r * np.cos(v))])
    return points, grid(rows, columns, True), normals, kappa, np.ones(len(u), bool), area


SURFACES = {"sphere": sphere, "cylinder": cylinder, "torus": torus}


# Contestants: from points, triangles and a radius to normals and curvatures.


def ours(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """Our features at every point of the bare cloud: oriented normals, curvatures, frames, rims."""
    from drake_aerial import PointCloud, compute_features
    from drake_aerial.features.surface_features import FeatureParameters

    features = compute_features(PointCloud.read(points), FeatureParameters(rho=radius, voxel=0.0))
    return features.normal, features.r / radius


def default(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """Our features as users get them."""
    from drake_aerial import PointCloud, compute_features

    features = compute_features(PointCloud.read(points))
    return features.normal, features.r / features.rho


def open3d_normals(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """Open3D's normals of the bare cloud, without outward sign."""
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamRadius(radius))
    return np.asarray(cloud.normals), None


def open3d_oriented(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """The same with Open3D's consistent signs, by the same number of neighbours as ours."""
    import open3d as o3d

    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamRadius(radius))
    cloud.orient_normals_consistent_tangent_plane(12)
    return np.asarray(cloud.normals), None


def libigl(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """Libigl's quadric through four rings of the mesh."""
    import igl

    _, _, largest, smallest, _ = igl.principal_curvature(points, faces, radius=4)
    return None, np.column_stack([largest, smallest])


def meshlab_cloud(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """MeshLab's normals of the bare cloud, by 50 neighbours."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points))
    meshes.compute_normal_for_point_clouds(k=NEIGHBOURS)
    return meshes.current_mesh().vertex_normal_matrix(), None


def meshlab_quadric(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """MeshLab's quadric through one ring of the mesh."""
    return None, meshlab_curvature(points, faces, method="Quadric Fitting")


def meshlab_scaled(points: np.ndarray, faces: Faces, radius: float) -> Answer:
    """MeshLab's quadric through the mesh within the radius."""
    import pymeshlab

    scale = pymeshlab.PureValue(radius)
    return None, meshlab_curvature(
        points, faces, method="Scale Dependent Quadric Fitting", scale=scale
    )


def meshlab_curvature(points: np.ndarray, faces: Faces, **options: object) -> np.ndarray:
    """Return MeshLab's curvatures by two runs, one per curvature; `measure` halves the time."""
    import pymeshlab

    meshes, found = pymeshlab.MeshSet(), []
    meshes.add_mesh(pymeshlab.Mesh(points, faces))
    for which in ("Min Curvature", "Max Curvature"):
        meshes.compute_curvature_principal_directions_per_vertex(
            curvcolormethod=which, autoclean=False, **options
        )
        found.append(meshes.current_mesh().vertex_scalar_array())
    return np.column_stack(found)


CONTESTANTS: dict[str, tuple[str, Callable[[np.ndarray, Faces, float], Answer], bool]] = {
    "ours": ("ours: cloud, everything", ours, False),
    "open3d_normals": ("Open3D: cloud, normals", open3d_normals, False),
    "open3d_oriented": ("Open3D: cloud, normals and sign", open3d_oriented, False),
    "meshlab_cloud": ("MeshLab: cloud, normals", meshlab_cloud, True),
    "libigl": ("libigl: mesh, curvatures", libigl, True),
    "meshlab_quadric": ("MeshLab: mesh, curvatures, 1 ring", meshlab_quadric, True),
    "meshlab_scaled": ("MeshLab: mesh, curvatures, radius", meshlab_scaled, True),
}


# Called once; the others three times.
SLOW = ("open3d_oriented", "libigl", "meshlab_scaled")


def measure(name: str, path: Path) -> dict[str, float]:
    """Run one contestant on a file, three times if it is fast; return best times and MB."""
    data = np.load(path)
    points, faces, radius = data["points"], data["faces"], float(data["radius"])
    compute = default if name == "default" else CONTESTANTS[name][1]
    if name in ("default", "ours"):
        # What every process that has computed anything has loaded.
        compute(points[:: max(1, len(points) // 5000)], faces, 5.0 * radius)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    times = []
    for _ in range(1 if name in SLOW or len(points) > 300_000 else 3):
        wall, cpu = time.perf_counter(), time.process_time()
        normals, kappa = compute(points, faces, radius)
        times.append((time.perf_counter() - wall, time.process_time() - cpu))
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    answer = {
        key: value for key, value in (("normals", normals), ("kappa", kappa)) if value is not None
    }
    np.savez(path.with_name("answer.npz"), **answer)
    share = 0.5 if name in ("meshlab_quadric", "meshlab_scaled") else 1.0
    wall, cpu = (share * min(column) for column in zip(*times, strict=True))
    number = len(next(iter(answer.values())))
    return {
        "number": number,
        "first": times[0][0],
        "wall": wall,
        "cpu": cpu,
        "before": before,
        "after": after,
    }


def in_process(python: Path, name: str, path: Path, cores: int | None = None) -> dict[str, float]:
    """Return what `measure` gives in a Python of its own, by so many cores."""
    environment = {
        key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")
    }
    if cores is not None:
        environment |= {f"{key}_NUM_THREADS": str(cores) for key in ("OMP", "OPENBLAS")}
    command = [str(python), str(Path(__file__).resolve()), "--measure", name, str(path)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return json.loads(done.stdout.splitlines()[-1])


def target(folder: Path) -> None:
    """Print what a scan of 100,000 points takes."""
    rng = np.random.default_rng(1)
    points = box(POINTS, 0.001, rng)
    print(f"\nScan of {POINTS:,} points of a box, 1 mm of noise (wanted: {WANTED} s)")
    print(f"{'features':<36}{'cores':>6}{'number':>9}{'first call s':>14}{'best s':>8}{'CPU s':>8}")
    area = 2.0 * (SIZE[0] * SIZE[1] + SIZE[0] * SIZE[2] + SIZE[1] * SIZE[2])
    faces, radius = np.zeros((0, 3), dtype=np.int64), radius_of(area, POINTS)
    np.savez(folder / "cloud.npz", points=points, faces=faces, radius=radius)
    kinds = {
        "default": "by default: rho 3 cm, voxel 7.5 mm",
        "ours": f"at every point, {NEIGHBOURS} neighbours",
    }
    for name, label in kinds.items():
        for cores in (1, 2):
            result = in_process(Path(sys.executable), name, folder / "cloud.npz", cores)
            print(
                f"{label:<36}{cores:>6}{result['number']:>9}{result['first']:>14.3f}"
                f"{result['wall']:>8.3f}{result['cpu']:>8.3f}",
                flush=True,
            )


def errors(answer: dict[str, np.ndarray], surface: Surface) -> str:
    """Return median and 95th percentile of the errors of normals [deg] and curvatures [%]."""
    _, _, normals, kappa, counts, _ = surface
    text = []
    if "normals" in answer:
        found = answer["normals"][counts] / np.linalg.norm(
            answer["normals"][counts], axis=1, keepdims=True
        )
        sine = np.linalg.norm(np.cross(found, normals[counts]), axis=1)
        angle = np.rad2deg(np.arcsin(np.minimum(sine, 1.0)))
        wrong = np.mean(np.sum(found * normals[counts], axis=1) < 0.0)
        text.append(f"{np.median(angle):>8.3f}{np.percentile(angle, 95):>8.3f}{100 * wrong:>9.1f}")
    else:
        text.append(f"{'':>25}")
    if "kappa" in answer:
        found = answer["kappa"][counts]
        found = np.take_along_axis(found, np.argsort(-np.abs(found), axis=1, kind="stable"), axis=1)
        # Some give convex a negative sign.
        found = found * np.sign(np.median(found[:, 0]))
        off = np.abs(found - kappa[counts]).max(axis=1) / np.abs(kappa[counts][:, 0])
        text.append(f"{100 * np.median(off):>9.2f}{100 * np.percentile(off, 95):>9.2f}")
    return "".join(text)


def peers(folder: Path, surfaces: list[str], python: Path | None) -> None:
    """Print times and errors of everyone on analytic surfaces."""
    if python is None:
        subprocess.run([sys.executable, "-m", "venv", str(folder / "peers")], check=True)
        python = folder / "peers" / "bin" / "python"
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    print(f"\nPeers, {POINTS:,} points; the best of three calls, of the slow ones one, all cores")
    print(
        f"{'':<44}{'wall s':>8}{'CPU s':>8}{'normals deg: 50, 95 %':>22}"
        f"{'inwards %':>10}{'curvature %: 50, 95 %':>23}"
    )
    for name in surfaces:
        make = SURFACES[name]
        for noise in (0.0, 0.0005):
            rng = np.random.default_rng(2)
            surface = make(POINTS, rng)
            points = surface[0] + noise * rng.standard_normal(surface[0].shape)
            radius = radius_of(surface[-1], len(points))
            np.savez(folder / "cloud.npz", points=points, faces=surface[1], radius=radius)
            print(f"{name}, noise {1e3 * noise:g} mm, radius {1e3 * radius:.1f} mm")
            for key, (label, _, foreign) in CONTESTANTS.items():
                result = in_process(
                    python if foreign else Path(sys.executable), key, folder / "cloud.npz"
                )
                with np.load(folder / "answer.npz") as data:
                    told = errors(dict(data), surface)
                print(
                    f"    {label:<40}{result['wall']:>8.2f}{result['cpu']:>8.2f}      {told}",
                    flush=True,
                )


def growth(folder: Path) -> None:
    """Print how time and memory grow with the number of points."""
    area = 2.0 * (SIZE[0] * SIZE[1] + SIZE[0] * SIZE[2] + SIZE[1] * SIZE[2])
    print(
        f"\nGrowth: features at every point, {NEIGHBOURS} neighbours each, two cores; "
        "best of three calls, above 300,000 points one call"
    )
    print(
        f"{'points':>10}{'wall s':>9}{'CPU s':>9}{'CPU ns / (n log2 n)':>21}"
        f"{'peak MB more':>14}{'bytes a point':>15}"
    )
    for count in SIZES:
        rng = np.random.default_rng(3)
        faces = np.zeros((0, 3), dtype=np.int64)
        radius = radius_of(area, count)
        # The noise falls with the spacing, so that a neighbourhood stays a surface.
        points = box(count, 0.03 * radius, rng)
        np.savez(folder / "cloud.npz", points=points, faces=faces, radius=radius)
        result = in_process(Path(sys.executable), "ours", folder / "cloud.npz", cores=2)
        more = result["after"] - result["before"]
        print(
            f"{count:>10,}{result['wall']:>9.2f}{result['cpu']:>9.2f}"
            f"{1e9 * result['cpu'] / (count * np.log2(count)):>21.1f}"
            f"{more:>14.0f}{more * 2**20 / count:>15.0f}",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--surfaces", nargs="+", choices=list(SURFACES), default=list(SURFACES))
    parser.add_argument("--python", type=Path, help="an environment that has the peers already")
    parser.add_argument("--measure", nargs=2, metavar=("WHO", "FILE"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(measure(arguments.measure[0], Path(arguments.measure[1]))))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        if "target" in arguments.parts:
            target(Path(folder))
        if "peers" in arguments.parts:
            peers(Path(folder), arguments.surfaces, arguments.python)
        if "growth" in arguments.parts:
            growth(Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
