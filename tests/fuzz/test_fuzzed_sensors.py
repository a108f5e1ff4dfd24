"""Damaged depth images, intrinsics, text clouds and bags: right, or refused with a true reason."""

import tempfile
from pathlib import Path

import numpy as np
import pytest

from drake_aerial import PointCloud, read_scan
from drake_aerial.errors import DrakeAerialError
from tests.fuzz.bounds import bounded, fuzzed
from tests.fuzz.hostile_sensors import bag_files, bag_messages, image_files, text_clouds

for library in ("rosbags", "OpenEXR"):
    pytest.importorskip(library)


def read(function, *arguments, **keywords):
    """Return the cloud and None, or None and the reason, after what holds for every reason."""
    with bounded():
        try:
            cloud, reason = function(*arguments, **keywords), None
        except DrakeAerialError as error:
            cloud, reason = None, str(error)
    if cloud is not None:
        assert np.isfinite(cloud.points).all()
        assert len(cloud) > 0
        return cloud, None
    assert reason.strip()
    assert len(reason) < 2000
    assert "\n" not in reason
    return None, reason


def written(name, data):
    path = Path(tempfile.mkdtemp(prefix="fuzz_")) / name
    path.write_bytes(data)
    return path


def check_image(drawn):
    suffix, image, camera, untouched = drawn
    path = written("a" + suffix, image)
    cloud, reason = read(read_scan, path, camera=written("camera.yaml", camera), up=[0, -1, 0])
    assert cloud is not None or not untouched, reason


test_images, test_images_many = fuzzed(check_image, image_files(), short=20, long=1800)


def check_text(drawn):
    suffix, data, points = drawn
    cloud, reason = read(PointCloud.read, written("a" + suffix, data))
    if points is not None:
        assert reason is None
        np.testing.assert_array_equal(cloud.points, points)
    if reason is not None and "cut short" in reason:
        declared = int(reason.split(" points declared")[0].split()[-1])
        assert str(declared).encode() in data


test_texts, test_texts_many = fuzzed(check_text, text_clouds(), short=30, long=1600)


def check_bag(drawn):
    suffix, data, topic, untouched = drawn
    cloud, reason = read(read_scan, written("a" + suffix, data), topic=topic)
    if untouched and topic in ("/points", "/depth/image"):
        assert cloud is not None, reason
    if untouched and topic in ("/imu", "points"):
        assert "`topic` must be" in reason
    if untouched and topic is None:
        assert "several topics with points, /depth/image, /points" in reason


test_bags, test_bags_many = fuzzed(check_bag, bag_files(), short=12, long=1000)


def check_messages(drawn):
    messages, topic = drawn
    from tests.scene.recorded_bags import write

    bag = write(Path(tempfile.mkdtemp(prefix="fuzz_")) / "bag", messages)
    read(read_scan, bag, topic=topic)


test_messages, test_messages_many = fuzzed(check_messages, bag_messages(), short=12, long=800)
