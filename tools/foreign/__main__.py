"""Write files with other libraries, in all their options, and read each with ours.

Run from the checkout: `python -m tools.foreign`. A file is right within the precision of its
numbers, or refused for the expected reason; everything else is listed, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from drake_aerial import InputError, read_scan

from . import clouds, meshes, sensors
from .cases import BOX, POINTS, Case

SOURCES = (
    clouds.open3d_clouds,
    clouds.trimesh_clouds,
    clouds.plyfile_clouds,
    clouds.pypcd4_clouds,
    clouds.numpy_clouds,
    clouds.lidar_files,
    meshes.open3d_meshes,
    meshes.trimesh_meshes,
    meshes.plyfile_meshes,
    meshes.meshio_meshes,
    sensors.depth_images,
    sensors.bags,
)


def cases() -> Iterator[Case]:
    """Yield all cases."""
    for source in SOURCES:
        yield from source()


def fault(case: Case, folder: Path) -> str | None:
    """Return what is wrong with reading a case, "refused" if it is refused rightly, else None."""
    path = folder / case.name
    case.write(path)
    try:
        cloud = read_scan(str(path), **(case.options or {}))
    except InputError as error:
        return "refused" if re.search(case.holds, str(error)) else f"refused: {error}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    if case.holds == "mesh":
        return _mesh_fault(cloud.points)
    if not case.holds.startswith("points"):
        return f"read, but expected the reason {case.holds!r}"
    expected = POINTS if case.expected is None else case.expected
    if cloud.points.shape != expected.shape:
        return f"{len(cloud)} points instead of {len(expected)}"
    error = float(np.abs(cloud.points - expected).max())
    return None if error <= case.tolerance else f"points are {error:.2g} m off"


def _mesh_fault(points: np.ndarray) -> str | None:
    """Return what is wrong with samples of the box's surface."""
    _, distance, _ = trimesh.proximity.closest_point_naive(
        BOX, points[:: max(1, len(points) // 500)]
    )
    if distance.max() > 1e-6:
        return f"samples are {distance.max():.2g} m off the surface"
    surface = trimesh.sample.sample_surface(BOX, 500, seed=3)[0]
    gap = float(cKDTree(points).query(surface)[0].max())
    return None if gap < 0.03 else f"no samples within {gap:.2g} m of a part of the surface"


def main() -> int:
    """Print a table of libraries, and what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--library", help="write files of this library only")
    only = parser.parse_args().library
    counts: Counter[tuple[str, str]] = Counter()
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        for number, case in enumerate(cases()):
            if only in (None, case.library):
                place = Path(folder) / str(number)
                place.mkdir()
                found = fault(case, place)
                result = "right" if found is None else "refused" if found == "refused" else "wrong"
                counts[case.library, result] += 1
                if result == "wrong":
                    faults.append(f"{case.library} {case.name}: {found}")
    print(f"{'library':12}{'files':>8}{'right':>8}{'refused':>9}{'wrong':>8}")
    results = ("right", "refused", "wrong")
    for library in dict.fromkeys(library for library, _ in counts):
        row = [counts[library, result] for result in results]
        print(f"{library:12}{sum(row):8d}{row[0]:8d}{row[1]:9d}{row[2]:8d}")
    total = [sum(counts[key] for key in counts if key[1] == result) for result in results]
    print(f"{'all':12}{sum(total):8d}{total[0]:8d}{total[1]:9d}{total[2]:8d}")
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
