"""Recordings of ROS 2 and ROS 1, bags, as point clouds; ROS is not needed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.point_cloud import PointCloud, position
from drake_aerial.cloud.raw_geometry import RawGeometry
from drake_aerial.errors import InputError
from drake_aerial.scene.bag_messages import (
    camera_of,
    chain_to_root,
    compressed_depths_of,
    depths_of,
    is_depth,
    points_of,
    up_of,
)
from drake_aerial.scene.depth_camera import DepthCamera
from drake_aerial.scene.depth_image import depth_points

_CLOUD, _IMAGE = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/Image"
_COMPRESSED = "sensor_msgs/msg/CompressedImage"
_INFO, _IMU = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/Imu"
_TRANSFORMS = "tf2_msgs/msg/TFMessage"
# Frames of REP 105, whose origin is not the sensor.
_NOT_SENSORS = ("earth", "map", "odom", "world", "base_link", "base_footprint")
# The IMU's messages within this time [ns] of the points give up; at most so many are read.
_IMU_WINDOW, _IMU_MESSAGES = 500_000_000, 2000


def is_bag(path: Path) -> bool:
    """Return True for a folder of rosbag2, or the name of a storage file."""
    return path.suffix.lower() in (".mcap", ".db3", ".bag") or os.path.isfile(
        path / "metadata.yaml"
    )


def read_bag(
    path: str | Path,
    topic: str | None = None,
    *,
    viewpoint: Any = None,
    up: Any = None,
    camera: Any = None,
) -> PointCloud:
    """Return the points of a topic's first message, in the frame of the message.

    Parameters
    ----------
    path : str or Path
        A folder of rosbag2, a .mcap or a .db3 file; or a .bag file of ROS 1.
    topic : str, optional
        A topic of PointCloud2, or of depth images; by default the only one.
    viewpoint : (3,) array or pose, optional
        The sensor's position in the frame of the points [m]; by default its origin, unless the
        frame is known not to be a sensor's, such as `map`.
    up : (3,) array, optional
        Direction against gravity in the frame of the points; by default from an IMU of the same
        frame.
    camera : path, dict or DepthCamera, optional
        Intrinsics of a depth image; by default from the CameraInfo of its namespace.

    Raises
    ------
    InputError
        If the library rosbags is not installed, the bag cannot be read, there is no such topic, or
        the points are not valid.
    """
    path = Path(path)
    if not os.path.exists(path):
        raise InputError(f"no such file: {path}")
    with _opened(path) as bag:
        chosen, assumptions = _choose(bag, path, topic, camera)
        time, message = _first(bag, chosen)
        label, frame = f"{path}, topic {chosen}", message.header.frame_id.strip("/")
        intrinsics = None
        kind = _types(bag)[chosen]
        if kind in (_IMAGE, _COMPRESSED):
            intrinsics = DepthCamera.read(camera) if camera else _camera(bag, chosen, label)
            depths = (depths_of if kind == _IMAGE else compressed_depths_of)(message, label)
            points = depth_points(depths, intrinsics, label)
        else:
            points = points_of(message, label)
        count = bag.topics[chosen].msgcount
        if count > 1:
            text = f"the first of the {count} messages of {chosen} is used"
            assumptions.append(Assumption(AssumptionKind.TOPIC, text))
        assumptions += _static_transforms(bag, frame)
        if up is None:
            up, found = _up(bag, frame, time)
            assumptions += found
    optical = intrinsics is not None or frame.endswith("optical_frame")
    if optical:
        if viewpoint is not None and position(viewpoint).any():
            raise InputError(
                f"`viewpoint` must not be given for {label}: the camera is at the origin"
            )
    elif viewpoint is None and frame.split("/")[-1] not in _NOT_SENSORS:
        viewpoint = np.zeros(3)
        text = f"the sensor is at the origin of the points' frame {frame!r}"
        assumptions.append(Assumption(AssumptionKind.OUTSIDE, text))
    origin = np.zeros(3) if optical else None
    raw = RawGeometry(
        points, None, label, str(path), origin, tuple(assumptions), in_camera_axes=optical
    )
    cloud = PointCloud.read(raw, viewpoint=viewpoint, up=up)
    return replace(cloud, topic=chosen, camera=intrinsics.to_dict() if intrinsics else None)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a bag; errors of the library, also later ones, are raised as InputError."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(
            f"cannot read {path}: the library rosbags is not installed; pip install rosbags"
        ) from error
    try:
        # Bags of old versions hold no message definitions.
        store = get_typestore(Stores.ROS2_HUMBLE)
        with AnyReader([path], default_typestore=store) as reader:
            yield reader
    except InputError:
        raise
    except PermissionError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    except MemoryError as error:
        raise InputError(
            f"cannot read {path} as a bag: it is damaged: it declares more data than fits in memory"
        ) from error
    except Exception as error:  # the library raises errors of many types
        reason = shorten(f"{type(error).__name__}: {error}", 200)
        raise InputError(f"cannot read {path} as a bag: {reason}") from error


def _types(bag: Any) -> dict[str, str]:
    """Return the message types of the topics that have messages."""
    return {name: info.msgtype for name, info in bag.topics.items() if info.msgcount}


def _messages(bag: Any, topic: str, **times: int) -> Iterator[tuple[int, Any]]:
    """Yield time [ns] and content of a topic's messages, in order of time."""
    for connection, time, data in bag.messages(bag.topics[topic].connections, **times):
        yield time, bag.deserialize(data, connection.msgtype)


def _first(bag: Any, topic: str) -> tuple[int, Any]:
    """Return time [ns] and content of a topic's first message."""
    found = next(_messages(bag, topic), None)
    if found is None:
        raise ValueError(f"the messages of {topic} are missing")
    return found


def _info_topic(topic: str) -> str:
    """Return the topic of the CameraInfo of an image's topic."""
    # The transports of compressed images append their own names.
    image = topic.removesuffix("/compressedDepth").removesuffix("/compressed")
    return image.rpartition("/")[0] + "/camera_info"


def _camera(bag: Any, topic: str, label: str) -> DepthCamera:
    """Return the intrinsics of an image's topic."""
    info = _info_topic(topic)
    if _types(bag).get(info) != _INFO:
        raise InputError(f"{label}: the bag has no CameraInfo {info}; give --camera camera.yaml")
    # By the convention of image_proc, only these have no distortion.
    rectified = "rect" in topic.rpartition("/")[2]
    return camera_of(_first(bag, info)[1], rectified=rectified)


def _choose(bag: Any, path: Path, topic: str | None, camera: Any) -> tuple[str, list[Assumption]]:
    """Return the topic of the points, and what was assumed."""
    types = _types(bag)
    if topic is not None and types.get(topic) in (_CLOUD, _IMAGE, _COMPRESSED):
        return topic, []
    there = "; ".join(
        f"{name} ({info.msgtype or 'several types'}, {info.msgcount})"
        for name, info in sorted(bag.topics.items())
    )
    there = f"the topics (type, messages) are: {there}" if there else "the bag has no topics"
    if topic is not None and topic not in types:
        raise InputError(f"`topic` must be one of {path} with messages, got {topic!r}; {there}")
    if topic is not None:
        raise InputError(
            f"`topic` must be a PointCloud2 or a depth Image, got {topic!r} of type "
            f"{types[topic]}; {there}"
        )
    usable = [
        name
        for name, kind in types.items()
        if kind == _CLOUD
        or (
            kind in (_IMAGE, _COMPRESSED)
            and (camera or types.get(_info_topic(name)) == _INFO)
            and is_depth(_first(bag, name)[1])
        )
    ]
    if len(usable) > 1:
        raise InputError(
            f"{path} has several topics with points, {', '.join(usable)}: give one as --topic; "
            f"{there}"
        )
    if not usable:
        raise InputError(
            f"{path} has no messages of PointCloud2, or of depth Image with its CameraInfo; {there}"
        )
    text = f"{usable[0]} is used, the only topic with points"
    return usable[0], [Assumption(AssumptionKind.TOPIC, text)]


def _static_transforms(bag: Any, frame: str) -> list[Assumption]:
    """Return what /tf_static says about the frame of the points."""
    if _types(bag).get("/tf_static") != _TRANSFORMS:
        return []
    messages = (message for _, message in _messages(bag, "/tf_static"))
    names, X_RF = chain_to_root(messages, frame)
    chain = " > ".join(reversed(names))
    if X_RF is None:
        text = f"/tf_static is left out: the chain {chain} has no single rigid path to a root"
    elif len(names) == 1:
        text = f"/tf_static is left out: it gives no parent of the points' frame {frame!r}"
    else:
        p, q = X_RF.p.round(6).tolist(), X_RF.q.round(6).tolist()
        text = (
            f"the points stay in {frame!r}, which /tf_static ({chain}) puts at {p} m, "
            f"quaternion w, x, y, z {q}"
        )
    return [Assumption(AssumptionKind.AXES, text)]


def _up(bag: Any, frame: str, time: int) -> tuple[Any, list[Assumption]]:
    """Return up by the IMU of the points' frame, at the time [ns] of the points, or None."""
    found = []
    for topic, kind in _types(bag).items():
        if kind != _IMU:
            continue
        of_imu = _first(bag, topic)[1].header.frame_id.strip("/")
        if of_imu != frame:
            reason = f"is in the frame {of_imu!r}, not in the points' frame {frame!r}"
        else:
            window = {"start": max(0, time - _IMU_WINDOW), "stop": time + _IMU_WINDOW}
            near = list(islice(_messages(bag, topic, **window), _IMU_MESSAGES))
            when = "" if near else ", not recorded at the time of the points"
            near = near or list(islice(_messages(bag, topic), _IMU_MESSAGES))
            up, reason = up_of(message for _, message in near)
            if up is not None:
                text = f"{up.round(4).tolist()} by the IMU {topic}: {reason}{when}"
                return up, [Assumption(AssumptionKind.UP, text)]
        found.append(Assumption(AssumptionKind.UP, f"the IMU {topic} is not used: it {reason}"))
    return None, found
