"""Points, intrinsics, frames and the up direction in ROS messages."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, Pose, identity, quat_normalize
from drake_aerial.scene.depth_camera import DepthCamera

# sensor_msgs/PointField: numpy's types by `datatype`.
_FIELD_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
# sensor_msgs/Image: numpy's types of depth encodings.
_DEPTH_TYPES = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
# Header of compressed_depth_image_transport: its format, and the two numbers of inverse depths.
_DEPTH_HEADER = np.dtype([("format", "<i4"), ("a", "<f4"), ("b", "<f4")])
_MAX_PIXELS = 2**26
# Mean specific force [m/s^2] of a sensor that hardly accelerates.
_SPECIFIC_FORCE = (8.0, 12.0)


def is_depth(image: Any) -> bool:
    """Return True if a sensor_msgs/Image or CompressedImage has a depth encoding."""
    if hasattr(image, "format"):
        return image.format.replace(";", " ").split()[:1] in [[kind] for kind in _DEPTH_TYPES]
    return image.encoding in _DEPTH_TYPES


def points_of(message: Any, label: str) -> Array:
    """Return the points (height * width, 3) of a sensor_msgs/PointCloud2; rows may be NaN.

    Raises
    ------
    InputError
        If it has no points, no field x, y or z, or less data than it declares.
    """
    fields = {field.name.lower(): field for field in message.fields}
    if not {"x", "y", "z"} <= set(fields):
        given = ", ".join(field.name for field in message.fields) or "none"
        raise InputError(f"{label} must have the fields x, y and z, got {given}")
    columns = [
        _strided(
            message,
            (message.height, message.width),
            _FIELD_TYPES.get(fields[name].datatype),
            fields[name].offset,
            (message.row_step, message.point_step),
            label,
        )
        for name in "xyz"
    ]
    return np.stack([column.astype(np.float64).ravel() for column in columns], axis=1)


def depths_of(message: Any, label: str) -> np.ndarray:
    """Return the depths (height, width) of a sensor_msgs/Image, in mm if whole numbers, else in m.

    Raises
    ------
    InputError
        If its encoding is not 16UC1, mono16 or 32FC1, or it has less data than it declares.
    """
    kind = _DEPTH_TYPES.get(message.encoding)
    if kind is None:
        accepted = ", ".join(_DEPTH_TYPES)
        raise InputError(
            f"{label} must have one of the encodings {accepted}, got "
            f"{message.encoding!r}; is it a colour image?"
        )
    shape, steps = (message.height, message.width), (message.step, np.dtype(kind).itemsize)
    depths = _strided(message, shape, kind, 0, steps, label)
    return depths.astype(np.dtype(kind))


def compressed_depths_of(message: Any, label: str) -> np.ndarray:
    """Return the depths (height, width) of a sensor_msgs/CompressedImage, in mm or m.

    Read are the formats of compressed_depth_image_transport with PNG, and plain PNG of 16 bits.

    Raises
    ------
    InputError
        If the format is another one, such as JPEG, or the data are no image.
    """
    words = message.format.replace(";", " ").split()
    data = message.data.tobytes()
    encoding = words[0] if words else ""
    inside = "compressedDepth" in words
    if (
        encoding not in _DEPTH_TYPES
        or any(word in words for word in ("jpeg", "jpg", "rvl"))
        or not (inside or "png" in words)
    ):
        raise InputError(
            f"{label} must be a depth image compressed as PNG, such as '16UC1; compressedDepth "
            f"png', got the format {message.format!r}; record the image without compression"
        )
    try:
        pixels = _png(data[_DEPTH_HEADER.itemsize :] if inside else data)
        if encoding != "32FC1" or not inside:
            return pixels
        header = np.frombuffer(data, _DEPTH_HEADER, 1)[0]
    except (ValueError, OSError) as error:
        raise InputError(f"{label}: the compressed image is damaged: {error}") from error
    # 32-bit depths are stored as inverse depths in steps.
    with np.errstate(divide="ignore", invalid="ignore"):
        depths = header["a"] / (pixels.astype(np.float64) - header["b"])
    return np.where(pixels > 0, depths, np.nan)


def _png(data: bytes) -> np.ndarray:
    """Return the pixels of a PNG file of 16 bits."""
    from PIL import Image

    with Image.open(io.BytesIO(data)) as image:
        if image.width * image.height > _MAX_PIXELS:
            raise ValueError(f"{image.width} x {image.height} pixels are more than {_MAX_PIXELS}")
        pixels = np.asarray(image)
    if pixels.ndim != 2 or pixels.dtype.itemsize < 2:
        raise ValueError(f"16 bits for each pixel are needed, got {pixels.dtype} {pixels.shape}")
    return pixels.astype(np.uint16)


def camera_of(message: Any, *, rectified: bool) -> DepthCamera:
    """Return the intrinsics of a sensor_msgs/CameraInfo.

    Parameters
    ----------
    message : sensor_msgs/CameraInfo
        Intrinsics of the raw image, and the projection `p` of the rectified image.
    rectified : bool
        True for an image without distortion, whose intrinsics are those of `p`.

    Raises
    ------
    InputError
        If the values are no intrinsics.
    """
    values = {"width": int(message.width), "height": int(message.height)}
    # ROS 1 has capital letters.
    d, k, p = (
        (message.d, message.k, message.p)
        if hasattr(message, "k")
        else (message.D, message.K, message.P)
    )
    if rectified and p[0] > 0.0:
        return DepthCamera.read(values | {"fx": p[0], "fy": p[5], "cx": p[2], "cy": p[6]})
    model = {"distortion_model": message.distortion_model, "d": d.tolist()}
    return DepthCamera.read(values | model | {"k": k.tolist()})


def up_of(messages: Iterable[Any]) -> tuple[Array | None, str]:
    """Return the up direction (3,) by the specific force of an IMU, and how it was found.

    Parameters
    ----------
    messages : iterable of sensor_msgs/Imu
        Messages of one frame; those without an acceleration are ignored.

    Returns
    -------
    tuple
        The mean direction, or None if it is not gravity's; and one line about it.
    """
    forces = np.array(
        [
            (force.x, force.y, force.z)
            for message in messages
            for force in [message.linear_acceleration]
            if message.linear_acceleration_covariance[0] != -1.0
        ]
    ).reshape(-1, 3)
    forces = forces[np.isfinite(forces).all(axis=1) & forces.any(axis=1)]
    if not len(forces):
        return None, "has no accelerations"
    mean = forces.mean(axis=0)
    size = float(np.linalg.norm(mean))
    if not _SPECIFIC_FORCE[0] <= size <= _SPECIFIC_FORCE[1]:
        low, high = _SPECIFIC_FORCE
        return None, f"has a mean specific force of {size:.3g} m/s^2, not {low:g} to {high:g}"
    cosines = forces @ mean / (size * np.linalg.norm(forces, axis=1))
    spread = np.rad2deg(np.sqrt(np.mean(np.arccos(np.clip(cosines, -1.0, 1.0)) ** 2)))
    return mean / size, f"mean of {len(forces)} specific forces, spread {spread:.2g} deg (RMS)"


def chain_to_root(messages: Iterable[Any], frame: str) -> tuple[list[str], Pose | None]:
    """Return the frames from `frame` to the root of /tf_static, and its pose in the root.

    Parameters
    ----------
    messages : iterable of tf2_msgs/TFMessage
        The static transforms.
    frame : str
        The frame of the points.

    Returns
    -------
    tuple
        The names, `frame` first, and X_RF. The pose is None if a frame of the chain has two
        parents or is its own ancestor, or a transform is not a rigid one.
    """
    parents: dict[str, tuple[str, Pose]] = {}
    ambiguous = set()
    for transform in (transform for message in messages for transform in message.transforms):
        child, parent = transform.child_frame_id.strip("/"), transform.header.frame_id.strip("/")
        p, q = transform.transform.translation, transform.transform.rotation
        pose = Pose(np.array([p.x, p.y, p.z]), np.array([q.w, q.x, q.y, q.z]))
        if child in parents and parents[child][0] != parent:
            ambiguous.add(child)
        parents[child] = parent, pose
    names, X_RF = [frame.strip("/")], identity()
    while names[-1] in parents:
        parent, X_PC = parents[names[-1]]
        rigid = np.isfinite(X_PC.p).all() and abs(np.linalg.norm(X_PC.q) - 1.0) < 1e-3
        if names[-1] in ambiguous or parent in names or not rigid:
            return names, None
        X_RF = Pose(X_PC.p, quat_normalize(X_PC.q)) @ X_RF
        names.append(parent)
    return names, X_RF


def _strided(
    message: Any,
    shape: tuple[int, int],
    kind: str | None,
    offset: int,
    steps: tuple[int, int],
    label: str,
) -> np.ndarray:
    """Return values (height, width) of a message's data, at `offset` of steps by row and column."""
    if kind is None:
        raise InputError(f"{label}: a field of x, y, z has an unknown datatype")
    height, width = shape
    row, column = steps
    if height * width == 0:
        raise InputError(f"{label} holds no points")
    size = np.dtype(kind).itemsize
    if height == 1 and row < width * column:
        row = width * column
    if offset + size > column or row < width * column:
        raise InputError(
            f"{label} has a row step of {row} and a point step of {column} bytes, too small for "
            f"{width} points with {size} bytes at {offset}"
        )
    needed = (height - 1) * row + (width - 1) * column + offset + size
    if needed > len(message.data):
        raise InputError(
            f"{label} is cut short: it must have {needed} bytes or more, got {len(message.data)}"
        )
    order = ">" if message.is_bigendian else "<"
    data = np.ascontiguousarray(message.data)
    return np.ndarray((height, width), order + kind, data, offset, (row, column))
