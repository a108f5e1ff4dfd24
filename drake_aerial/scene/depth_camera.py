"""A depth camera's intrinsics, and the rays of its pixels."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.geometry import Array
from drake_aerial.io.strict_yaml import check_keys, numbers, read_mapping
from drake_aerial.scene.distortion import MODELS, undistort

# Fields of view [deg] of depth cameras; others come from a focal length in millimetres.
_FIELDS_OF_VIEW = (2.0, 170.0)


@dataclass(frozen=True)
class DepthCamera:
    """Intrinsics of a depth camera. In its frame, x is right, y down and z forward.

    Attributes
    ----------
    width, height : int
        Size of the image [pixels].
    fx, fy : float
        Focal lengths [pixels].
    cx, cy : float
        Principal point [pixels]; the centre of the first pixel is (0, 0).
    depth_scale : float or None
        Depth units per metre: 1000 for millimetres. By default 1000 for images of whole numbers,
        1 for floating-point ones.
    distortion_model : str
        `plumb_bob`, `rational_polynomial` or `equidistant`, as in ROS and OpenCV.
    distortion : tuple of float
        Its coefficients; empty for none.

    Examples
    --------
    >>> from drake_aerial import DepthCamera
    >>> camera = DepthCamera(640, 480, fx=600.0, fy=600.0, cx=319.5, cy=239.5)
    >>> camera.rays().shape
    (480, 640, 2)
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    depth_scale: float | None = None
    distortion_model: str = "plumb_bob"
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check the intrinsics.

        Raises
        ------
        InputError
            If a value is impossible, such as a principal point outside the image.
        """
        if not (self.width >= 1 and self.height >= 1):
            raise InputError(
                f"`width` and `height` must be positive, got {self.width} and {self.height}"
            )
        for axis, size in (("x", self.width), ("y", self.height)):
            focal, centre = getattr(self, f"f{axis}"), getattr(self, f"c{axis}")
            if not (np.isfinite(focal) and focal > 0.0):
                raise InputError(f"`f{axis}` must be a positive number of pixels, got {focal}")
            view = np.rad2deg(2.0 * np.arctan(0.5 * size / focal))
            if not _FIELDS_OF_VIEW[0] <= view <= _FIELDS_OF_VIEW[1]:
                raise InputError(
                    f"`f{axis}` = {focal:g} gives a field of view of {view:.3g} deg for {size} "
                    "pixels; give the focal length in pixels"
                )
            if not -0.5 <= centre <= size - 0.5:
                raise InputError(
                    f"`c{axis}` must be in the image of {size} pixels, got {centre:g}; "
                    "give the intrinsics of this image size"
                )
        if self.depth_scale is not None and not 0.0 < self.depth_scale < np.inf:
            raise InputError(
                f"`depth_scale` must be positive, in units per metre, got {self.depth_scale}"
            )
        counts = MODELS.get(self.distortion_model)
        if counts is None:
            accepted = ", ".join(MODELS)
            raise InputError(
                f"`distortion_model` must be one of {accepted}, got {self.distortion_model!r}"
            )
        if len(self.distortion) not in (0, *counts):
            raise InputError(
                f"`distortion` of {self.distortion_model} must have "
                f"{' or '.join(map(str, counts))} coefficients, got {len(self.distortion)}"
            )
        if not np.isfinite(self.distortion).all():
            raise InputError(f"`distortion` must be finite, got {list(self.distortion)}")

    @classmethod
    def read(cls, source: Any) -> DepthCamera:
        """Read intrinsics from a YAML file, a mapping or an object.

        Parameters
        ----------
        source : path, dict, DepthCamera or pydrake CameraInfo
            A file or mapping with the attributes' names, or a ROS camera_info: the message, or the
            file that camera calibration writes.

        Raises
        ------
        InputError
            If the file cannot be read, or its values are no intrinsics.
        """
        if isinstance(source, cls):
            return source
        if hasattr(source, "focal_x"):
            return cls(
                source.width(),
                source.height(),
                source.focal_x(),
                source.focal_y(),
                source.center_x(),
                source.center_y(),
            )
        where = str(source) if isinstance(source, str | Path) else "the camera"
        values = source if isinstance(source, dict) else read_mapping(source)
        if not {"fx", "fy"} & set(values):
            values = _from_camera_info(values, where)
        check_keys(
            values,
            where=f"{where}: ",
            required=("width", "height", "fx", "fy", "cx", "cy"),
            optional=("depth_scale", "distortion_model", "distortion"),
        )
        given: dict[str, Any] = {
            key: float(numbers(values[key], (), f"{where}: {key}"))
            for key in ("width", "height", "fx", "fy", "cx", "cy", "depth_scale")
            if key != "depth_scale" or values.get(key) is not None
        }
        for key in ("width", "height"):
            if given[key] != int(given[key]):
                raise InputError(f"{where}: {key} must be a whole number, got {given[key]}")
            given[key] = int(given[key])
        if "distortion_model" in values:
            given["distortion_model"] = str(values["distortion_model"])
        if values.get("distortion"):
            count = len(values["distortion"]) if isinstance(values["distortion"], list) else 0
            given["distortion"] = tuple(
                numbers(values["distortion"], (count,), f"{where}: distortion").tolist()
            )
        try:
            return cls(**given)
        except InputError as error:
            raise InputError(f"{where}: {error}") from error

    def to_dict(self) -> dict[str, Any]:
        """Return the attributes by name, as `read` takes them."""
        return asdict(self) | {"distortion": list(self.distortion)}

    def rays(self) -> Array:
        """Return x/z and y/z of the rays of all pixels, (height, width, 2), undistorted.

        NaN for pixels to which the distortion maps no ray.
        """
        v, u = np.mgrid[: self.height, : self.width].astype(np.float64)
        rays = np.stack([(u - self.cx) / self.fx, (v - self.cy) / self.fy], axis=-1)
        if any(self.distortion):
            return undistort(self.distortion_model, self.distortion, rays)
        return rays


def _from_camera_info(values: dict[str, Any], where: str) -> dict[str, Any]:
    """Return our keys for those of a ROS camera_info message or calibration file."""
    lower = {str(key).lower(): value for key, value in values.items()}

    def data(*names: str) -> Any:
        value = next((lower[name] for name in names if name in lower), None)
        return value.get("data") if isinstance(value, dict) else value

    matrix = data("k", "camera_matrix")
    if matrix is None:
        raise InputError(
            f"{where}: no intrinsics; give width, height, fx, fy, cx, cy, or a ROS camera_info"
        )
    fx, _, cx, _, fy, cy, _, _, _ = numbers(matrix, (9,), f"{where}: camera matrix").tolist()
    found = {
        "width": data("width", "image_width"),
        "height": data("height", "image_height"),
        **{"fx": fx, "fy": fy, "cx": cx, "cy": cy},
        "distortion_model": data("distortion_model") or "plumb_bob",
        "distortion": data("d", "distortion_coefficients") or [],
        "depth_scale": data("depth_scale"),
    }
    return {key: value for key, value in found.items() if value is not None}
