"""A sample of the files that `python -m tools.foreign` writes with other libraries."""

import importlib
from collections import defaultdict

import pytest

LIBRARIES = ("open3d", "trimesh", "plyfile", "pypcd4", "meshio", "laspy", "pye57", "rosbags")


def sample():
    """Return a few cases of each library, with all kinds of files."""
    for module in (*LIBRARIES, "OpenEXR", "cv2"):
        pytest.importorskip(module)
    foreign = importlib.import_module("tools.foreign.__main__")
    found = defaultdict(list)
    for case in foreign.cases():
        found[case.library].append(case)
    return foreign, [case for cases in found.values() for case in cases[:: max(1, len(cases) // 3)]]


def test_files_of_other_libraries_are_right_or_refused_for_the_true_reason(tmp_path):
    foreign, cases = sample()
    assert {case.library for case in cases} >= set(LIBRARIES)
    faults = {}
    for number, case in enumerate(cases):
        folder = tmp_path / str(number)
        folder.mkdir()
        if (found := foreign.fault(case, folder)) not in (None, "refused"):
            faults[f"{case.library} {case.name}"] = found
    assert faults == {}


def test_wrong_points_are_a_fault(tmp_path):
    foreign, cases = sample()
    case = next(case for case in cases if case.library == "numpy" and case.holds == "points")
    moved = case.__class__(
        case.library, case.name, case.write, expected=foreign.POINTS + [0.0, 0.0, 1e-5]
    )
    assert foreign.fault(moved, tmp_path).startswith("points are 1e-05 m off")
