"""Layouts of messages, and what an IMU and /tf_static say about the points' frame."""

import json

import numpy as np
import pytest

from drake_aerial import read_scan
from drake_aerial.errors import InputError
from drake_aerial.geometry import rotate
from tests.scene.recorded_bags import (
    DEPTH,
    POINTS,
    cloud,
    image,
    imu,
    info,
    make,
    texts,
    transforms,
    write,
)


@pytest.mark.parametrize(
    ("layout", "step"),
    [
        ({"x": (0, "<f4"), "y": (4, "<f4"), "z": (8, "<f4"), "rgb": (16, "<f4")}, 32),
        ({"intensity": (0, "<u2"), "z": (3, "<f4"), "x": (9, "<f4"), "y": (17, "<f4")}, 21),
        ({"x": (0, ">f4"), "y": (4, ">f4"), "z": (8, ">f4")}, 12),
        ({"x": (8, "<f8"), "y": (16, "<f8"), "z": (24, "<f8")}, 40),
        ({"x": (0, ">f8"), "y": (8, ">f8"), "ring": (16, ">u1"), "z": (17, ">f4")}, 26),
    ],
)
@pytest.mark.parametrize(("rows", "padding"), [(1, 0), (20, 0), (20, 13)])
def test_layouts_of_points(tmp_path, layout, step, rows, padding):
    message = cloud(layout=layout, step=step, rows=rows, padding=padding)
    scan = read_scan(write(tmp_path / "bag", {"/points": message}))
    np.testing.assert_allclose(scan.points, POINTS, rtol=0, atol=1e-7)


def test_rows_of_nan_are_dropped(tmp_path):
    points = POINTS.copy()
    points[::3] = np.nan
    scan = read_scan(write(tmp_path / "bag", {"/points": cloud(points)}))
    assert (len(scan), scan.dropped_points) == (400, 200)


@pytest.mark.parametrize(
    ("depth", "encoding"),
    [(DEPTH, "16UC1"), (DEPTH, "mono16"), ((DEPTH / 1000).astype(np.float32), "32FC1")],
)
@pytest.mark.parametrize(("big", "padding"), [(False, 0), (True, 12)])
def test_depth_images(tmp_path, depth, encoding, big, padding):
    messages = {
        "/camera/depth/image_raw": image(depth, encoding, big, padding),
        "/camera/depth/camera_info": info(),
    }
    scan = read_scan(write(tmp_path / "bag", messages), up=[0, -1, 0])
    v, u = np.nonzero(DEPTH)
    z = DEPTH[v, u] / 1000
    expected = np.stack([(u - 31) / 60 * z, (v - 24) / 61 * z, z], axis=1)
    np.testing.assert_allclose(scan.points, expected, rtol=0, atol=1e-6)
    assert scan.camera["fx"] == 60
    np.testing.assert_array_equal(scan.viewpoint, [0, 0, 0])
    with pytest.raises(InputError, match="camera axes; up is unknown"):
        read_scan(tmp_path / "bag").require_up()
    with pytest.raises(InputError, match=r"`viewpoint` must not be given .* at the origin"):
        read_scan(tmp_path / "bag", viewpoint=[0, 0, 1])


def test_a_rectified_image_has_the_projection_and_no_distortion(tmp_path):
    messages = {"/depth/image_rect": image(), "/depth/camera_info": info([0.3, 0.1, 0, 0, 0])}
    scan = read_scan(write(tmp_path / "bag", messages))
    assert (scan.camera["fx"], scan.camera["cy"], scan.camera["distortion"]) == (50, 22, [])
    messages = {"/depth/image_raw": image(), "/depth/camera_info": info([0.3, 0.1, 0, 0, 0])}
    scan = read_scan(write(tmp_path / "raw", messages))
    assert (scan.camera["fx"], scan.camera["distortion"]) == (60, [0.3, 0.1, 0, 0, 0])


def test_the_imu_of_the_same_frame_gives_up(tmp_path):
    up = np.array([0.6, 0.0, 0.8])
    side = np.array([0.0, 1.0, 0.0])
    # Half of the directions are 2 degrees to one side, half to the other.
    forces = [9.8 * (np.cos(a) * up + np.sin(a) * side) for a in np.deg2rad([2, -2] * 10)]
    gyro = imu([5.0, 5.0, 5.0], covariance=-1.0)
    messages = {"/points": cloud(), "/imu": [gyro, *map(imu, forces)]}
    bag = write(tmp_path / "bag", messages)
    scan = read_scan(bag)
    np.testing.assert_allclose(scan.up, up, atol=1e-12)
    text = "[0.6, 0.0, 0.8] by the IMU /imu: mean of 20 specific forces, spread 2 deg (RMS)"
    assert texts(scan, "up") == [text]
    np.testing.assert_array_equal(read_scan(bag, up=[0, 0, 1]).up, [0, 0, 1])


@pytest.mark.parametrize("later", [400_000_000, 600_000_000])
def test_the_imu_is_read_within_half_a_second_of_the_points(tmp_path, later):
    messages = {"/points": cloud(), "/imu": [imu([0, 0, 9.8]), imu([0, 3, 9.0])]}
    scan = read_scan(write(tmp_path / "bag", messages, step=later))
    assert (scan.up[1] == 0.0) == (later > 500_000_000)


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        (
            imu([0, 9.8, 0], frame="base"),
            "is in the frame 'base', not in the points' frame 'lidar'",
        ),
        (imu([0, 0.2, 0]), "has a mean specific force of 0.2 m/s^2, not 8 to 12"),
        (imu([0, 9.8, 0], covariance=-1.0), "has no accelerations"),
    ],
)
def test_an_imu_that_does_not_measure_gravity_is_left_out(tmp_path, message, reason):
    scan = read_scan(write(tmp_path / "bag", {"/points": cloud(), "/imu": message}))
    np.testing.assert_array_equal(scan.up, [0, 0, 1])
    assert texts(scan, "up")[0] == f"the IMU /imu is not used: it {reason}"


HALF = np.sqrt(0.5)
MAST = ("base_link", "mast", (1.0, 2.0, 3.0), (HALF, 0.0, 0.0, HALF))
HEAD = ("mast", "lidar", (0.5, 0.0, 0.0), (HALF, HALF, 0.0, 0.0))


def test_a_chain_of_static_transforms_is_recorded(tmp_path):
    bag = write(tmp_path / "bag", {"/points": cloud(), "/tf_static": transforms(MAST, HEAD)})
    # The mast turns x to y, so the head is 0.5 m along y.
    (text,) = texts(read_scan(bag), "axes")
    assert "(base_link > mast > lidar) puts at [1.0, 2.5, 3.0] m" in text
    q = np.array(json.loads(text.rpartition("z ")[2]))
    np.testing.assert_allclose(rotate(q, [0.0, 0.0, 1.0]), [1, 0, 0], atol=1e-5)


@pytest.mark.parametrize(
    ("links", "reason"),
    [
        ([HEAD, ("other", "lidar", *HEAD[2:])], "no single rigid path to a root"),
        ([HEAD, ("lidar", "mast", *HEAD[2:])], "no single rigid path to a root"),
        ([("mast", "lidar", (0.0, 0.0, 0.0), (0.0,) * 4)], "no single rigid path to a root"),
        ([MAST], "gives no parent of the points' frame 'lidar'"),
    ],
)
def test_static_transforms_that_are_not_a_chain_are_left_out(tmp_path, links, reason):
    bag = write(tmp_path / "bag", {"/points": cloud(), "/tf_static": transforms(*links)})
    (text,) = texts(read_scan(bag), "axes")
    assert text.startswith("/tf_static is left out: ")
    assert reason in text


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 0, "data": np.zeros(0, np.uint8)}, "topic /points holds no points"),
        (
            {"data": np.zeros(100, np.uint8)},
            "is cut short: it must have 7192 bytes or more, got 100",
        ),
        ({"point_step": 8}, "has a row step of 7200 and a point step of 8 bytes, too small"),
        ({"fields": []}, "must have the fields x, y and z, got none"),
    ],
)
def test_impossible_points_are_refused(tmp_path, values, message):
    given = vars(cloud()) | values
    bag = write(tmp_path / "bag", {"/points": make("sensor_msgs/PointCloud2", **given)})
    with pytest.raises(InputError, match=message):
        read_scan(bag)
