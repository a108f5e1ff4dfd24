"""Bags that the library rosbags wrote are read as clouds; what they lack is said."""

import json
import sys

import numpy as np
import pytest

from drake_aerial import read_scan
from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
from drake_aerial.cli import main
from drake_aerial.contacts.scan_lookup import find_scan
from drake_aerial.errors import InputError
from drake_aerial.geometry import rotate
from drake_aerial.skill.demonstration import Demonstration

rosbag2 = pytest.importorskip("rosbags.rosbag2")
from rosbags.typesys import Stores, get_typestore  # noqa: E402

STORE = get_typestore(Stores.ROS2_HUMBLE)
RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-0.4, 0.4, (600, 3)) * [1.0, 0.7, 0.0] + [0.1, 0.2, -1.5]
PLAIN = {"x": (0, "<f4"), "y": (4, "<f4"), "z": (8, "<f4")}
CODES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


def make(kind, **values):
    return STORE.types[kind.replace("/", "/msg/")](**values)


def header(frame):
    stamp = make("builtin_interfaces/Time", sec=1, nanosec=0)
    return make("std_msgs/Header", stamp=stamp, frame_id=frame)


def cloud(points=POINTS, frame="lidar", layout=PLAIN, step=12, rows=1, padding=0):
    """A PointCloud2 of the points; the layout is offset and type by field."""
    width = len(points) // rows
    row_step = width * step + padding
    data = np.full(rows * row_step, 0xA5, np.uint8)
    for name, (offset, kind) in layout.items():
        size = np.dtype(kind).itemsize
        values = points[:, "xyz".index(name)] if name in "xyz" else np.arange(len(points))
        raw = np.frombuffer(np.asarray(values).astype(kind).tobytes(), np.uint8)
        for k, value in enumerate(raw.reshape(-1, size)):
            start = (k // width) * row_step + (k % width) * step + offset
            data[start : start + size] = value
    fields = [
        make("sensor_msgs/PointField", name=name, offset=offset, datatype=CODES[kind[1:]], count=1)
        for name, (offset, kind) in layout.items()
    ]
    return make(
        "sensor_msgs/PointCloud2",
        header=header(frame),
        height=rows,
        width=width,
        fields=fields,
        is_bigendian=any(kind[0] == ">" for _, kind in layout.values()),
        point_step=step,
        row_step=row_step,
        data=data,
        is_dense=False,
    )


DEPTH = np.zeros((48, 64), np.uint16)
DEPTH[10:40, 12:50] = 1000 + RNG.integers(0, 200, (30, 38))


def image(depth=DEPTH, encoding="16UC1", big=False, padding=0):
    rows = depth.astype(depth.dtype.newbyteorder(">" if big else "<")).view(np.uint8)
    rows = rows.reshape(len(depth), -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=7)
    return make(
        "sensor_msgs/Image",
        header=header("camera_depth_optical_frame"),
        height=depth.shape[0],
        width=depth.shape[1],
        encoding=encoding,
        is_bigendian=int(big),
        step=rows.shape[1],
        data=rows.ravel(),
    )


def info(d=(0.0,) * 5, p=(50.0, 51.0, 30.0, 22.0)):
    roi = make(
        "sensor_msgs/RegionOfInterest",
        **dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0),
        do_rectify=False,
    )
    return make(
        "sensor_msgs/CameraInfo",
        header=header("camera_depth_optical_frame"),
        height=48,
        width=64,
        distortion_model="plumb_bob",
        d=np.array(d),
        k=np.array([60.0, 0, 31, 0, 61, 24, 0, 0, 1]),
        r=np.eye(3).ravel(),
        p=np.array([p[0], 0, p[2], 0, 0, p[1], p[3], 0, 0, 0, 1, 0]),
        binning_x=0,
        binning_y=0,
        roi=roi,
    )


def imu(force, frame="lidar", covariance=0.0):
    vector = "geometry_msgs/Vector3"
    return make(
        "sensor_msgs/Imu",
        header=header(frame),
        orientation=make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=np.zeros(9),
        angular_velocity=make(vector, x=0.0, y=0.0, z=0.0),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=make(vector, **dict(zip("xyz", map(float, force)))),
        linear_acceleration_covariance=np.array([covariance] + [0.0] * 8),
    )


def transforms(*links):
    """A TFMessage of links: parent, child, translation and quaternion w, x, y, z."""
    return make(
        "tf2_msgs/TFMessage",
        transforms=[
            make(
                "geometry_msgs/TransformStamped",
                header=header(parent),
                child_frame_id=child,
                transform=make(
                    "geometry_msgs/Transform",
                    translation=make("geometry_msgs/Vector3", **dict(zip("xyz", p))),
                    rotation=make("geometry_msgs/Quaternion", **dict(zip("wxyz", q))),
                ),
            )
            for parent, child, p, q in links
        ],
    )


def write(path, messages, storage="MCAP", step=10_000_000):
    """Write topics and their messages, `step` ns apart, as a folder of rosbag2."""
    plugin = rosbag2.StoragePlugin[storage]
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        for topic, given in messages.items():
            given = given if isinstance(given, list) else [given]
            kind = given[0].__msgtype__
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for k, message in enumerate(given):
                data = STORE.serialize_cdr(message, kind)
                writer.write(connection, 1_000_000_000 + k * step, data)
    return path


def texts(scan, kind):
    return [assumption.text for assumption in scan.assumptions if assumption.kind == kind]


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
@pytest.mark.parametrize("single_file", [False, True])
def test_folders_and_single_files(tmp_path, storage, single_file):
    bag = write(tmp_path / "bag", {"/points": cloud()}, storage)
    if single_file:
        bag = next(path for path in bag.iterdir() if path.suffix in (".mcap", ".db3"))
    scan = read_scan(bag)
    np.testing.assert_array_equal(scan.points, POINTS.astype("f4"))
    np.testing.assert_array_equal(scan.viewpoint, [0, 0, 0])
    assert texts(scan, "topic") == ["/points is used, the only topic with points"]
    assert texts(scan, "outside") == ["the sensor is at the origin of the points' frame 'lidar'"]
    assert scan.topic == "/points"


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


def test_an_image_without_its_camera_info_needs_a_camera(tmp_path):
    bag = write(tmp_path / "bag", {"/depth/image_raw": image(), "/other/camera_info": info()})
    with pytest.raises(InputError, match="the bag has no CameraInfo /depth/camera_info; give --c"):
        read_scan(bag, topic="/depth/image_raw")
    (tmp_path / "camera.yaml").write_text("{width: 64, height: 48, fx: 60, fy: 61, cx: 31, cy: 24}")
    assert len(read_scan(bag, camera=tmp_path / "camera.yaml")) == 30 * 38


def test_one_of_several_topics_must_be_named(tmp_path, capsys):
    near, far = cloud(POINTS), cloud(POINTS + [0, 0, -1])
    bag = write(tmp_path / "bag", {"/near": near, "/far": [far, near], "/imu": imu([0, 0, 9.8])})
    listed = (
        r"/far \(sensor_msgs/msg/PointCloud2, 2\); /imu \(sensor_msgs/msg/Imu, 1\); "
        r"/near \(sensor_msgs/msg/PointCloud2, 1\)"
    )
    with pytest.raises(InputError, match=f"several topics with points, .*--topic; .*{listed}"):
        read_scan(bag)
    with pytest.raises(InputError, match=rf"`topic` must be one of .*, got '/x'; .*{listed}"):
        read_scan(bag, topic="/x")
    with pytest.raises(InputError, match=rf"must be a PointCloud2 or a .*got '/imu'.*{listed}"):
        read_scan(bag, topic="/imu")
    scan = read_scan(bag, topic="/far")
    assert scan.points[:, 2].mean() == pytest.approx(-2.5)
    assert texts(scan, "topic") == ["the first of the 2 messages of /far is used"]
    out = tmp_path / "contacts.json"
    assert main(["transfer", "flat", str(bag), "--topic", "/x", "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert "got '/x'" in error
    assert not out.exists()


def test_colour_images_are_no_topic_with_points(tmp_path):
    colour = image(np.zeros((48, 64 * 3), np.uint8), "rgb8")
    messages = {"/rgb/image_raw": colour, "/rgb/camera_info": info(), "/points": cloud()}
    bag = write(tmp_path / "bag", messages)
    assert len(read_scan(bag)) == 600
    with pytest.raises(InputError, match="got 'rgb8'; is it a colour image"):
        read_scan(bag, topic="/rgb/image_raw")


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
    assert texts(scan, "up") == [f"the IMU /imu is not used: it {reason}"]


def test_the_sensor_is_not_at_the_origin_of_a_map(tmp_path):
    bag = write(tmp_path / "bag", {"/points": cloud(frame="map")})
    assert read_scan(bag).viewpoint is None
    np.testing.assert_array_equal(read_scan(bag, viewpoint=[0, 0, 2]).viewpoint, [0, 0, 2])


def test_points_of_an_optical_frame_are_in_camera_axes(tmp_path):
    scan = read_scan(write(tmp_path / "bag", {"/points": cloud(frame="camera_optical_frame")}))
    with pytest.raises(InputError, match="camera axes; up is unknown"):
        scan.require_up()


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


def test_a_bag_without_points_lists_what_it_has(tmp_path):
    bag = write(tmp_path / "bag", {"/imu": imu([0, 0, 9.8])})
    with pytest.raises(InputError, match=r"no messages of PointCloud2.*/imu \(sensor_msgs/msg/Imu"):
        read_scan(bag)
    with rosbag2.Writer(tmp_path / "empty", version=9):
        pass
    with pytest.raises(InputError, match="the bag has no topics"):
        read_scan(tmp_path / "empty")


@pytest.mark.parametrize("storage", ["MCAP", "SQLITE3"])
def test_damaged_bags_are_refused(tmp_path, storage):
    bag = write(tmp_path / "bag", {"/points": cloud()}, storage)
    file = next(path for path in bag.iterdir() if path.suffix in (".mcap", ".db3"))
    data = file.read_bytes()
    for damaged in (b"", b"no bag", data[:100], data[: len(data) // 2]):
        file.write_bytes(damaged)
        for path in (file, bag):
            with pytest.raises(InputError, match=r"cannot read .* as a bag: .") as caught:
                read_scan(path)
            assert "\n" not in str(caught.value)
    (bag / "metadata.yaml").write_text("{")
    with pytest.raises(InputError, match=r"cannot read .* as a bag: .") as caught:
        read_scan(bag)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_a_bag_takes_no_topic(tmp_path):
    np.save(tmp_path / "a.npy", POINTS)
    with pytest.raises(InputError, match="`topic` must be given for a bag only"):
        read_scan(tmp_path / "a.npy", topic="/points")
    with pytest.raises(InputError, match="no such file"):
        read_scan(tmp_path / "a.mcap")


def test_without_the_library_the_message_names_it(tmp_path, monkeypatch):
    bag = write(tmp_path / "bag", {"/points": cloud()})
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(InputError, match="rosbags is not installed; pip install rosbags"):
        read_scan(bag)


@pytest.mark.parametrize("frame", ["lidar", "map", "camera_optical_frame"])
def test_contacts_find_the_bag_again(tmp_path, frame):
    messages = {"/a": cloud(frame=frame), "/b": cloud(POINTS + 1.0, frame=frame)}
    scan = read_scan(write(tmp_path / "bag", messages), topic="/b", up=[0, 1, 0])
    again = find_scan(scan.to_record(), tmp_path)
    np.testing.assert_array_equal(again.points, scan.points)
    np.testing.assert_array_equal(again.up, scan.up)
    assert (again.viewpoint is None) == (frame == "map")


def test_a_demonstration_names_the_topic_of_its_bag(tmp_path):
    top = RNG.uniform(-0.3, 0.3, (5000, 3)) * [1.0, 1.0, 0.0]
    messages = {"/a": cloud(top + 1.0), "/b": cloud(top), "/imu": imu([0, 9.8, 0])}
    bag = write(tmp_path / "bag", messages)
    scan = read_scan(bag, topic="/b", up=[0, 0, 1], viewpoint=[0, 0, 2])
    draft = DemonstrationDraft(scan, source=bag)
    shown = draft.demonstration([[0.1, 0.05, 0.0]], name="top")
    again = Demonstration.read(draft.write(tmp_path / "top.yaml", shown)).cloud
    np.testing.assert_array_equal(again.points, scan.points)
    np.testing.assert_array_equal(again.up, [0, 0, 1])
    np.testing.assert_array_equal(again.viewpoint, [0, 0, 2])


def test_contacts_find_the_depth_image_of_a_bag_again(tmp_path):
    messages = {"/depth/image_raw": image(), "/depth/camera_info": info([0.1, 0, 0, 0, 0])}
    scan = read_scan(write(tmp_path / "bag", messages), up=[0, -1, 0])
    np.testing.assert_array_equal(find_scan(scan.to_record(), None).points, scan.points)
