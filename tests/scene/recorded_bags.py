"""ROS 2 messages, and bags of them, by the library rosbags."""

import numpy as np
import pytest

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
