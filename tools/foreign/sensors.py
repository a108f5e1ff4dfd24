"""Depth images by OpenEXR, Pillow and OpenCV, and bags by rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from .cases import POINTS, RNG, Case

CAMERA = {"width": 48, "height": 36, "fx": 50.0, "fy": 51.0, "cx": 23.5, "cy": 17.0}
DEPTH = np.round(1.0 + 0.2 * RNG.random((36, 48)), 3)
V, U = np.mgrid[:36, :48]
DEPTH_POINTS = np.stack(
    [(U - 23.5) / 50.0 * DEPTH, (V - 17.0) / 51.0 * DEPTH, DEPTH], axis=-1
).reshape(-1, 3)
MILLIMETRES = np.round(1000.0 * DEPTH).astype(np.uint16)


def depth_images() -> Iterator[Case]:
    """Yield depth images of all types, and images that are none."""
    import cv2
    import OpenEXR
    from PIL import Image

    options = {"camera": CAMERA, "up": [0.0, -1.0, 0.0]}

    def case(library: str, name: str, write: Any, holds: str = "points", tolerance: float = 2e-4):
        return Case(library, name, write, holds, tolerance, options, DEPTH_POINTS)

    compressions = (
        OpenEXR.NO_COMPRESSION,
        OpenEXR.RLE_COMPRESSION,
        OpenEXR.ZIPS_COMPRESSION,
        OpenEXR.ZIP_COMPRESSION,
        OpenEXR.PIZ_COMPRESSION,
    )
    for (number, compression), channel, kind in product(
        enumerate(compressions), ("Z", "Y", "R"), ("float32", "float16")
    ):

        def write(path, compression=compression, channel=channel, kind=kind):
            header = {"compression": compression, "type": OpenEXR.scanlineimage}
            OpenEXR.File(header, {channel: DEPTH.astype(kind)}).write(str(path))

        coarse = 2e-3 if kind == "float16" else 1e-6
        yield case("OpenEXR", f"{channel}_{kind}_{number}.exr", write, tolerance=coarse)
    for name, image, holds in (
        ("mm.png", MILLIMETRES, "points"),
        ("mm.tif", MILLIMETRES, "points"),
        ("m.tif", DEPTH.astype(np.float32), "points"),
        ("int32.tif", MILLIMETRES.astype(np.int32), "points"),
        ("8bit.png", (MILLIMETRES // 8).astype(np.uint8), "16 bits or more"),
        ("colour.png", np.zeros((36, 48, 3), np.uint8), "one depth for each pixel"),
        ("turned.png", np.ascontiguousarray(MILLIMETRES.T), "36 x 48 pixels"),
        ("empty.png", 0 * MILLIMETRES, "no pixel has a depth"),
    ):
        write = lambda p, a=image: Image.fromarray(a).save(p)  # noqa: E731
        yield case("Pillow", name, write, holds, 1e-6)
    for name, image in (
        ("mm_cv.png", MILLIMETRES),
        ("mm_cv.tiff", MILLIMETRES),
        ("m_cv.tiff", DEPTH.astype(np.float32)),
        ("m64_cv.tiff", DEPTH),
    ):
        holds = "points" if name != "m64_cv.tiff" else "of numbers that Pillow does not read"
        yield case("OpenCV", name, lambda p, a=image: cv2.imwrite(str(p), a), holds, 1e-6)
    for name, image in (("m.npy", DEPTH), ("mm.npy", MILLIMETRES), ("f2.npy", DEPTH.astype("f2"))):
        coarse = 2e-3 if name == "f2.npy" else 1e-6
        yield case("numpy", "depth_" + name, lambda p, a=image: np.save(p, a), tolerance=coarse)


def bags() -> Iterator[Case]:
    """Yield bags of both storages with clouds and depth images of all layouts."""
    from rosbags.rosbag2 import StoragePlugin

    for storage, kind, big, rows, spare in product(
        StoragePlugin, ("f4", "f8"), (False, True), (1, 20), (0, 12)
    ):

        def write(path, storage=storage, kind=kind, big=big, rows=rows, spare=spare):
            message = _cloud(POINTS, kind, big, rows, spare)
            _write_bag(path, storage, {"/points": message})

        name = f"{storage.name}_{kind}_{'big' if big else 'little'}_{rows}_{spare}"
        yield Case("rosbags", name, write, tolerance=1e-6, options={"up": [0.0, 0.0, 1.0]})
    for encoding, holds in (
        ("16UC1", "points"),
        ("32FC1", "points"),
        ("rgb8", "no messages of PointCloud2, or of depth Image"),
    ):

        def write(path, encoding=encoding):
            image, info = _image(encoding)
            messages = {"/depth/image": image, "/depth/camera_info": info}
            _write_bag(path, StoragePlugin.MCAP, messages)

        options = {"up": [0.0, -1.0, 0.0]}
        yield Case("rosbags", f"image_{encoding}", write, holds, 1e-6, options, DEPTH_POINTS)


def _types() -> Any:
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE)


def _make(kind: str, **values: Any) -> Any:
    return _types().types[kind.replace("/", "/msg/")](**values)


def _header(frame: str) -> Any:
    stamp = _make("builtin_interfaces/Time", sec=1, nanosec=0)
    return _make("std_msgs/Header", stamp=stamp, frame_id=frame)


def _cloud(points: np.ndarray, kind: str, big: bool, rows: int, spare: int) -> Any:
    """Return a PointCloud2 with `spare` bytes after each point."""
    size = np.dtype(kind).itemsize
    layout = [(axis, (">" if big else "<") + kind) for axis in "xyz"]
    table = np.zeros(len(points), [*layout, *([("spare", "u1", spare)] if spare else [])])
    for k, axis in enumerate("xyz"):
        table[axis] = points[:, k]
    code = {"f4": 7, "f8": 8}[kind]
    fields = [
        _make("sensor_msgs/PointField", name=axis, offset=k * size, datatype=code, count=1)
        for k, axis in enumerate("xyz")
    ]
    width = len(points) // rows
    return _make(
        "sensor_msgs/PointCloud2",
        header=_header("map"),
        height=rows,
        width=width,
        fields=fields,
        is_bigendian=big,
        point_step=table.itemsize,
        row_step=table.itemsize * width,
        data=np.frombuffer(table.tobytes(), np.uint8),
        is_dense=True,
    )


def _image(encoding: str) -> tuple[Any, Any]:
    """Return a depth image, or a colour image, and its CameraInfo."""
    values = {"16UC1": MILLIMETRES, "32FC1": DEPTH.astype("f4")}.get(encoding)
    values = np.zeros((36, 48, 3), np.uint8) if values is None else values
    image = _make(
        "sensor_msgs/Image",
        header=_header("camera_depth_optical_frame"),
        height=36,
        width=48,
        encoding=encoding,
        is_bigendian=0,
        step=values.nbytes // 36,
        data=np.frombuffer(values.tobytes(), np.uint8),
    )
    fx, fy, cx, cy = (CAMERA[key] for key in ("fx", "fy", "cx", "cy"))
    none = dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0)
    info = _make(
        "sensor_msgs/CameraInfo",
        header=image.header,
        height=36,
        width=48,
        distortion_model="plumb_bob",
        d=np.zeros(5),
        k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1]),
        r=np.eye(3).ravel(),
        p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0]),
        binning_x=0,
        binning_y=0,
        roi=_make("sensor_msgs/RegionOfInterest", **none, do_rectify=False),
    )
    return image, info


def _write_bag(path: Any, storage: Any, messages: dict[str, Any]) -> None:
    from rosbags.rosbag2 import Writer

    store = _types()
    with Writer(path, version=9, storage_plugin=storage) as writer:
        for topic, message in messages.items():
            kind = message.__msgtype__
            connection = writer.add_connection(topic, kind, typestore=store)
            writer.write(connection, 1_000_000_000, store.serialize_cdr(message, kind))
