"""Count views in camera axes that are recognised, and scans with z up taken for them.

Shapes, cameras and filters differ from those that chose the thresholds of
`drake_aerial.cloud.sensor_axes`: those were boxes, cylinders, trays, an L, a ridge, spheres, rocks,
terrain, plates and a table with boxes.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator

import numpy as np
import trimesh

from drake_aerial.cloud.partial_views import partial_view
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.sensor_axes import camera_axes
from drake_aerial.geometry import Array
from drake_aerial.io.model_files import models_dir

ANSWERS = ("recognised", "undecided", "taken for z up")
CAMERAS = {"oblique": (15.0, 75.0), "level": (-2.0, 8.0), "downwards": (84.0, 89.9)}
FILTERS = (
    "none",
    "voxels of 3 mm",
    "voxels of 6 mm",
    "voxels of 12 mm",
    "rounded to mm",
    "cleaned",
)


def shapes(rng: np.random.Generator) -> Iterator[tuple[str, trimesh.Trimesh]]:
    """Yield names and meshes that stand on z = 0."""
    creation = trimesh.creation
    lower = creation.box(rng.uniform([0.3, 0.2, 0.05], [0.6, 0.5, 0.15]))
    upper = creation.box(rng.uniform([0.1, 0.1, 0.1], [0.2, 0.2, 0.3]))
    upper.apply_translation([*rng.uniform(-0.05, 0.05, 2), 0.0])
    yield "stepped box", trimesh.util.concatenate([lower, upper])
    yield "torus", creation.torus(rng.uniform(0.15, 0.3), rng.uniform(0.03, 0.08))
    lying = creation.capsule(rng.uniform(0.2, 0.5), rng.uniform(0.05, 0.15))
    lying.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    yield "capsule", lying
    yield "cone", creation.cone(rng.uniform(0.1, 0.2), rng.uniform(0.15, 0.4))
    legs = [creation.box([0.04, 0.04, 0.3]) for _ in range(4)]
    for leg, (x, y) in zip(legs, [(-1, -1), (-1, 1), (1, -1), (1, 1)], strict=True):
        leg.apply_translation([0.2 * x, 0.15 * y, -0.15])
    yield "stool", trimesh.util.concatenate([creation.box([0.5, 0.4, 0.05]), *legs])
    floor = creation.box([3.0, 2.0, 0.02])
    things = [creation.cylinder(rng.uniform(0.05, 0.15), h := rng.uniform(0.1, 0.3))]
    things[0].apply_translation([*rng.uniform(-0.3, 0.3, 2), 0.5 * h + 0.01])
    yield "floor with a can", trimesh.util.concatenate([floor, *things])
    for path in sorted((models_dir() / "meshes").glob("*.obj")):
        mesh = trimesh.load(path, force="mesh")
        mesh.apply_scale(0.5 / mesh.extents.max())
        yield path.stem, mesh


def camera_view(
    mesh: trimesh.Trimesh, elevation: tuple[float, float], rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return one view's points (N, 3) in the camera's axes and in the mesh's frame, with noise."""
    angle, turn = np.deg2rad(rng.uniform(*elevation)), rng.uniform(0.0, 2.0 * np.pi)
    middle = mesh.bounds.mean(axis=0) + 0.05 * rng.standard_normal(3)
    forward = -np.array([np.cos(angle) * np.cos(turn), np.cos(angle) * np.sin(turn), np.sin(angle)])
    eye = middle - rng.uniform(0.8, 2.0) * forward
    size = ((320, 240), (424, 240), (640, 480))[rng.integers(3)]
    cloud = partial_view(
        mesh,
        eye,
        target=middle,
        resolution=size,
        fov=np.deg2rad(rng.uniform(45.0, 85.0)),
        noise=rng.choice([0.0, 0.001, 0.003]),
        rng=rng,
    )
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R_WC = np.stack([right, np.cross(forward, right), forward], axis=1)
    return (cloud.points - eye) @ R_WC, cloud.points


def filtered(points: Array, name: str, rng: np.random.Generator) -> Array:
    """Return shuffled points after a filter."""
    if name.startswith("voxels"):
        size = float(name.split()[2]) * 1e-3
        points = PointCloud.read(points, viewpoint=[0.0, 0.0, 99.0]).downsampled(size).points
    elif name == "rounded to mm":
        points = np.round(points, 3)
    elif name == "cleaned":
        import open3d as o3d

        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        cloud = cloud.voxel_down_sample(0.005)
        points = np.asarray(cloud.remove_statistical_outlier(20, 2.0)[0].points)
    return points[rng.permutation(len(points))]


def answer(points: Array) -> str:
    """Return one of `ANSWERS`."""
    axes = camera_axes(points)
    return ANSWERS[2] if axes is None else ANSWERS[0] if axes.certain else ANSWERS[1]


def upright(mesh: trimesh.Trimesh, view: Array, rng: np.random.Generator) -> Iterator[Array]:
    """Yield scans with z up whose points are all above or below the origin."""
    full = trimesh.sample.sample_surface(mesh, 20_000, seed=int(rng.integers(2**31)))[0]
    for points in (view, full, full[full[:, 2] > full[:, 2].min() + 0.004]):
        for height in (rng.uniform(0.6, 1.5), -rng.uniform(1.0, 2.0)):
            yield points + [*rng.uniform(-0.4, 0.4, 2), height]


def main() -> None:
    """Print a table: rows are cameras and filters, columns are answers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    seeds = parser.parse_args().seeds
    counts: Counter[tuple[str, str]] = Counter()
    wrong: Counter[str] = Counter()
    for seed in range(100, 100 + seeds):
        for number, (name, mesh) in enumerate(shapes(np.random.default_rng(seed))):
            rng = np.random.default_rng([seed, number])
            for camera, elevation in CAMERAS.items():
                view_C, view_W = camera_view(mesh, elevation, rng)
                if len(view_C) < 500:
                    continue
                for filter_name in FILTERS:
                    points = filtered(view_C, filter_name, rng)
                    for row, flip in (("z forward", [1, 1, 1]), ("z backward", [1, -1, -1])):
                        found = answer(points * flip)
                        counts[f"{camera}, {row}, filter: {filter_name}", found] += 1
                        wrong[f"view of {name} taken for z up"] += found == ANSWERS[2]
                if camera == "oblique":
                    for points in upright(mesh, view_W, rng):
                        row = "above" if points[:, 2].min() > 0.0 else "below"
                        found = answer(points)
                        counts[f"scan with z up, {row} the origin", found] += 1
                        wrong[f"scan of {name} with z up, {row}, refused"] += found == ANSWERS[0]
    print(f"{'':52}" + "".join(f"{text:>16}" for text in ANSWERS))
    for row in dict.fromkeys(row for row, _ in counts):
        print(f"{row:52}" + "".join(f"{counts[row, text]:16d}" for text in ANSWERS))
    for text, count in wrong.items():
        if count:
            print(f"{count} x {text}")


if __name__ == "__main__":
    main()
