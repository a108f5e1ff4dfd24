"""Compressed depth images, bags of ROS 1, and scans that `fly` is given anew."""

import argparse
import io

import numpy as np
import pytest
from PIL import Image

from drake_aerial.cli.fly import _scan
from drake_aerial.errors import InputError
from drake_aerial.named_inputs import read_scan

pytest.importorskip("rosbags")
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from tests.scene.recorded_bags import (
    DEPTH,
    POINTS,
    cloud,
    header,
    image,
    info,
    make,
    write,
)

ROS1 = get_typestore(Stores.ROS1_NOETIC)
UP = {"up": [0.0, -1.0, 0.0]}


def png(pixels):
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "PNG")
    return data.getvalue()


def compressed(form, data):
    return make(
        "sensor_msgs/CompressedImage",
        header=header("camera_depth_optical_frame"),
        format=form,
        data=np.frombuffer(data, np.uint8),
    )


def with_header(a, b, data):
    return np.array([1], "<i4").tobytes() + np.array([a, b], "<f4").tobytes() + data


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plain")
    messages = {"/depth/image": image(), "/depth/camera_info": info()}
    return read_scan(write(folder / "bag", messages), **UP).points


@pytest.mark.parametrize(
    ("form", "data", "topic"),
    [
        ("16UC1; compressedDepth png", with_header(0, 0, png(DEPTH)), "/compressedDepth"),
        ("16UC1; compressedDepth", with_header(0, 0, png(DEPTH)), "/compressedDepth"),
        ("16UC1; png compressed ", png(DEPTH), "/compressed"),
    ],
)
def test_lossless_compressed_depths_are_those_of_the_image(tmp_path, plain, form, data, topic):
    messages = {f"/depth/image{topic}": compressed(form, data), "/depth/camera_info": info()}
    scan = read_scan(write(tmp_path / "bag", messages), **UP)
    np.testing.assert_array_equal(scan.points, plain)
    assert scan.topic == f"/depth/image{topic}"


def test_inverse_depths_of_32_bits_are_right_within_a_step(tmp_path, plain):
    # As compressed_depth_image_transport computes them, for depths up to 10 m.
    quantum, farthest = 100.0, 10.0
    a = quantum * (quantum + 1.0)
    b = 1.0 - a / farthest
    metres = DEPTH / 1000.0
    with np.errstate(divide="ignore"):
        inverse = np.where(DEPTH > 0, np.round(a / np.maximum(metres, 1e-9) + b), 0.0)
    data = with_header(a, b, png(inverse.astype(np.uint16)))
    messages = {
        "/depth/image/compressedDepth": compressed("32FC1; compressedDepth png", data),
        "/depth/camera_info": info(),
    }
    scan = read_scan(write(tmp_path / "bag", messages), **UP)
    np.testing.assert_allclose(scan.points[:, 2], plain[:, 2], atol=1e-4)


@pytest.mark.parametrize(
    ("form", "data", "reason"),
    [
        ("16UC1; compressedDepth rvl", b"12", "compressed as PNG, .* without compression"),
        ("16UC1; jpeg compressed", b"12", "compressed as PNG"),
        ("rgb8; jpeg compressed bgr8", b"12", "compressed as PNG"),
        ("", b"", "compressed as PNG, .* got the format ''"),
        ("16UC1; compressedDepth png", b"12", "image is damaged"),
        ("32FC1; compressedDepth png", b"1" * 40, "image is damaged"),
        ("16UC1; png compressed", png(DEPTH.astype(np.uint8)), "16 bits for each pixel"),
    ],
)
def test_other_compressed_images_are_refused(tmp_path, form, data, reason):
    messages = {"/a/image/compressed": compressed(form, data), "/a/camera_info": info()}
    with pytest.raises(InputError, match=reason):
        read_scan(write(tmp_path / "bag", messages), topic="/a/image/compressed")


def of_ros1(message):
    """The same message as ROS 1 has it: capital letters in CameraInfo, and a sequence number."""
    kind = ROS1.types[message.__msgtype__]
    values = {}
    for name in kind.__dataclass_fields__:
        if name == "__msgtype__":
            continue
        value = 0 if name == "seq" else getattr(message, name, getattr(message, name.lower(), 0))
        values[name] = of_ros1(value) if hasattr(value, "__msgtype__") else value
        if isinstance(value, list):
            values[name] = [of_ros1(entry) for entry in value]
    return kind(**values)


def write_ros1(path, messages):
    with Writer(path) as writer:
        for topic, message in messages.items():
            kind = message.__msgtype__
            connection = writer.add_connection(topic, kind, typestore=ROS1)
            writer.write(connection, 1, ROS1.serialize_ros1(of_ros1(message), kind))
    return path


def test_a_cloud_of_ros1_is_read(tmp_path):
    scan = read_scan(write_ros1(tmp_path / "a.bag", {"/points": cloud()}), up=[0, 0, 1])
    np.testing.assert_allclose(scan.points, POINTS, atol=1e-7)


def test_a_depth_image_of_ros1_is_read(tmp_path, plain):
    messages = {"/depth/image": image(), "/depth/camera_info": info()}
    scan = read_scan(write_ros1(tmp_path / "a.bag", messages), **UP)
    np.testing.assert_array_equal(scan.points, plain)


def test_a_file_that_is_no_bag_of_ros1_is_refused(tmp_path):
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V1.2\n")
    with pytest.raises(InputError, match="as a bag"):
        read_scan(tmp_path / "a.bag")


def fly_scan(tmp_path, record, cloud=None, topic=None):
    from drake_aerial import read_skill, transfer
    from drake_aerial.contacts.solutions import ContactSolutions

    path = tmp_path / "contacts.json"
    if not path.exists():
        transfer(read_skill("flat"), record, method="centroid").write(path)
    assert ContactSolutions.read(path).cloud["points"] == len(record)
    cloud = None if cloud is None else str(cloud)
    return _scan(argparse.Namespace(contacts=path, cloud=cloud, topic=topic))


def test_a_moved_bag_is_read_with_topic_up_and_viewpoint_of_the_contacts(tmp_path):
    flat = np.random.default_rng(1).uniform(-0.3, 0.3, (4000, 3)) * [1, 1, 0] + [0, 0, -1.0]
    messages = {"/a/points": cloud(flat), "/b/points": cloud(flat + [0, 0, 0.1])}
    bag = write(tmp_path / "bag", messages)
    scan = read_scan(bag, topic="/b/points", up=[0.0, 0.1, 1.0])
    moved = bag.rename(tmp_path / "moved")
    again = fly_scan(tmp_path, scan, moved)
    assert again.topic == "/b/points"
    assert again.sha256 == scan.sha256
    np.testing.assert_allclose(again.up, scan.up)
    assert fly_scan(tmp_path, scan, moved, "/a/points").topic == "/a/points"
    assert fly_scan(tmp_path, scan) is None
    np.save(tmp_path / "points.npy", scan.points)
    np.testing.assert_array_equal(
        fly_scan(tmp_path, scan, tmp_path / "points.npy").points, scan.points
    )
    for given in (None, tmp_path / "points.npy"):
        with pytest.raises(InputError, match="--topic needs --cloud BAG"):
            fly_scan(tmp_path, scan, given, "/a/points")
