"""Depth images: files and arrays of one depth for each pixel, as points in the camera's frame."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.raw_geometry import RawGeometry
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.archives import load_arrays
from drake_aerial.scene.depth_camera import DepthCamera

FORMATS = (".png", ".tif", ".tiff", ".exr", ".npy")
# Images of more pixels are refused: a file of kilobytes may ask for gigabytes.
_MAX_PIXELS = 2**26
# Median depths [m] of scenes. Others come from a wrong unit.
_DEPTHS = (0.05, 60.0)


def read_depth_image(source: Any, camera: Any, *, up: ArrayLike | None = None) -> PointCloud:
    """Return the points of a depth image, in the camera's frame: x right, y down, z forward.

    Pixels without a depth (zero, negative, not finite, or the largest whole number) are dropped.

    Parameters
    ----------
    source : path, (H, W) array or pydrake depth image
        A depth image of whole numbers (.png, .tif, .npy) or floating-point numbers (.tif, .npy;
        .exr with the library OpenEXR). Depths are along z, not along the ray.
    camera : path, dict, DepthCamera or pydrake CameraInfo
        Intrinsics; see `DepthCamera.read`.
    up : (3,) array, optional
        Direction against gravity in the camera's frame. Without it, `transfer` refuses the cloud.

    Raises
    ------
    InputError
        If the image or the camera cannot be read, their sizes differ, no pixel has a depth, or the
        depths are implausible in metres.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import DepthCamera, read_depth_image
    >>> camera = DepthCamera(64, 48, fx=60.0, fy=60.0, cx=31.5, cy=23.5)
    >>> wall = np.full((48, 64), 1500, dtype=np.uint16)  # millimetres
    >>> cloud = read_depth_image(wall, camera, up=[0, -1, 0])
    >>> len(cloud), cloud.points[:, 2].max().item()
    (3072, 1.5)
    """
    intrinsics = DepthCamera.read(camera)
    path = str(source) if isinstance(source, str | Path) else None
    label = path or "the depth image"
    image = _read_file(Path(path)) if path else np.asarray(getattr(source, "data", source))
    points = depth_points(image, intrinsics, label)
    raw = RawGeometry(points, None, label, path, np.zeros(3), in_camera_axes=True)
    cloud = PointCloud.read(raw, up=up)
    return cloud.from_camera(intrinsics.to_dict())


def depth_points(image: np.ndarray, camera: DepthCamera, label: str) -> Array:
    """Return the points (H * W, 3) [m] of a depth image (H, W), NaN where there is no depth."""
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[..., 0]
    if image.ndim != 2:
        raise InputError(f"{label} must have one depth for each pixel, got shape {image.shape}")
    if image.shape != (camera.height, camera.width):
        raise InputError(
            f"{label} is {image.shape[1]} x {image.shape[0]} pixels, but the camera has "
            f"{camera.width} x {camera.height}; give the intrinsics of this image"
        )
    if image.dtype.kind not in "fiu" or image.dtype.itemsize < 2:
        raise InputError(
            f"{label} must hold depths of 16 bits or more, got {image.dtype}; is it a colour image?"
        )
    whole = image.dtype.kind in "iu"
    scale = camera.depth_scale or (1000.0 if whole else 1.0)
    depth = image.astype(np.float64) / scale
    invalid = ~np.isfinite(depth) | (depth <= 0.0)
    if whole:
        invalid |= image == np.iinfo(image.dtype).max
    depth[invalid] = np.nan
    if invalid.all():
        raise InputError(f"{label}: no pixel has a depth")
    median = float(np.nanmedian(depth))
    if not _DEPTHS[0] <= median <= _DEPTHS[1]:
        raise InputError(
            f"{label}: the median depth is {median:.3g} m at {scale:g} units per metre; "
            "give `depth_scale` (1000 for millimetres, 1 for metres) in the camera file"
        )
    points = np.concatenate([camera.rays(), np.ones((*depth.shape, 1))], axis=-1)
    points *= depth[..., None]
    return points.reshape(-1, 3)


def _read_file(path: Path) -> np.ndarray:
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        accepted = " ".join(FORMATS)
        raise InputError(f"{path} is not a depth image; accepted formats are {accepted}")
    if not os.path.isfile(path):
        raise InputError(f"no such file: {path}")
    if suffix == ".npy":
        return np.asarray(load_arrays(path))
    try:
        return _read_exr(path) if suffix == ".exr" else _read_image(path)
    except InputError:
        raise
    except ImportError as error:
        raise InputError(f"cannot read {path}: EXR needs OpenEXR; pip install OpenEXR") from error
    except OSError as error:
        reason = error.strerror or " ".join(str(error).split())
        raise InputError(f"cannot read {path}: {reason}") from error
    except Exception as error:  # the libraries raise errors of many types
        raise InputError(f"cannot read {path}: {' '.join(str(error).split())}") from error


def _read_image(path: Path) -> np.ndarray:
    from PIL import Image, UnidentifiedImageError

    try:
        opened = Image.open(path)
    except UnidentifiedImageError as error:
        raise InputError(
            f"cannot read {path}: not an image, or of numbers that Pillow does not read; save "
            "whole numbers of 16 bits or floating-point numbers of 32 bits"
        ) from error
    with opened as image:
        if image.width * image.height > _MAX_PIXELS:
            raise InputError(
                f"{path} must have at most {_MAX_PIXELS} pixels, got {image.width} x {image.height}"
            )
        return np.asarray(image)


def _read_exr(path: Path) -> np.ndarray:
    import OpenEXR

    try:
        channels: Any = OpenEXR.File(str(path), separate_channels=True).channels()
    except Exception as error:  # its messages do not name the cause
        raise InputError(f"cannot read {path}: not an EXR file, or damaged or cut short") from error
    name = next((name for name in ("Z", "Y", "V", "depth.Z", "R") if name in channels), None)
    if name is None:
        raise InputError(f"{path} has no channel Z, only {', '.join(channels) or 'none'}")
    return np.asarray(channels[name].pixels)
