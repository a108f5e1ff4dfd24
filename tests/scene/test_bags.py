"""Bags that the library rosbags wrote are read as clouds, or refused with the reason."""

import sys

import numpy as np
import pytest

from drake_aerial import read_scan
from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
from drake_aerial.cli import main
from drake_aerial.contacts.scan_lookup import find_scan
from drake_aerial.errors import InputError
from drake_aerial.skill.demonstration import Demonstration
from tests.scene.recorded_bags import POINTS, RNG, cloud, image, imu, info, rosbag2, texts, write


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


def test_the_sensor_is_not_at_the_origin_of_a_map(tmp_path):
    bag = write(tmp_path / "bag", {"/points": cloud(frame="map")})
    assert read_scan(bag).viewpoint is None
    np.testing.assert_array_equal(read_scan(bag, viewpoint=[0, 0, 2]).viewpoint, [0, 0, 2])


def test_points_of_an_optical_frame_are_in_camera_axes(tmp_path):
    scan = read_scan(write(tmp_path / "bag", {"/points": cloud(frame="camera_optical_frame")}))
    with pytest.raises(InputError, match="camera axes; up is unknown"):
        scan.require_up()


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
    with pytest.raises(InputError, match="`topic` may be given only for a bag"):
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


def test_a_length_beyond_memory_is_a_damaged_bag(tmp_path, monkeypatch):
    from drake_aerial.scene import bags

    def endless(*_):
        raise MemoryError

    bag = write(tmp_path / "bag", {"/points": cloud()})
    monkeypatch.setattr(bags, "_choose", endless)
    with pytest.raises(InputError, match="damaged: it declares more data than fits in memory"):
        read_scan(bag)
