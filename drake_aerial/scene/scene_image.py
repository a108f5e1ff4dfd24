"""A scene's cloud on a grid of pixels: the camera's own, or one laid over the cloud."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.cloud.sensor_axes import camera_axes, lattice_step
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, as_pose, matrix_from_quat, perpendicular
from drake_aerial.scene.depth_camera import DepthCamera
from drake_aerial.scene.distortion import distort

# A point on a camera's pixel grid is this close [pixels] to a pixel's centre.
_ON_PIXEL = 0.25
# Grids laid over a cloud have this many points a pixel where there are any, and at most this many
# rows and columns.
_POINTS_PER_PIXEL, _MAX_SIDE = 2.5, 2048
# A pixel without a point takes its neighbours' mean if at least this many of eight have points.
_FILLED_NEIGHBOURS = 5


@dataclass(frozen=True, eq=False)
class SceneImage:
    """A cloud in its own frame S, and the pixel of each of its points.

    The image frame C has x right, y down and z away from the viewer. A cloud with a viewpoint is
    projected through it; one without (several views fused) is seen from above, in parallel.

    Attributes
    ----------
    cloud : PointCloud
        The scene's points, in S.
    index : (H, W) int array
        For each pixel the nearest of the cloud's points in it; -1 where there is none.
    pixel : (N, 2) int array
        Row and column of each point; -1 for points behind the viewer.
    points_C : (H, W, 3) array
        The pixels' points in the image frame [m]; NaN where there is none. Single pixels without a
        point have their neighbours' mean.
    R_SC : (3, 3) array
        Rotation of the image frame.
    origin : (3,) array
        Origin of the image frame in S [m].
    viewpoint : (3,) array or None
        Position of the camera in S [m]; None for a parallel view from above.
    camera : DepthCamera or None
        Intrinsics, if they are known and the pixels are the camera's.
    has_own_pixels : bool
        True if the pixels are the camera's, False if a grid is laid over the cloud.
    """

    cloud: PointCloud
    index: NDArray[np.int64]
    pixel: NDArray[np.int64]
    points_C: Array
    R_SC: Array
    origin: Array
    viewpoint: Array | None
    camera: DepthCamera | None
    has_own_pixels: bool

    @classmethod
    def of_cloud(cls, cloud: PointCloud, X_SC: Any = None) -> SceneImage:
        """Return the image of a cloud.

        The pixels are the camera's own for a depth image or a cloud in a camera's axes; else a grid
        is laid over the cloud, seen from its viewpoint, or from above if it has none.

        Parameters
        ----------
        cloud : PointCloud
            The scene's points.
        X_SC : Pose or pydrake RigidTransform, optional
            Pose of the camera in S, if the points were moved out of the camera's frame.
        """
        if X_SC is not None:
            pose = as_pose(X_SC)
            R_SC, viewpoint = matrix_from_quat(pose.q), np.asarray(pose.p, dtype=np.float64)
        else:
            axes = camera_axes(cloud.points) if cloud.camera is None else None
            backward = axes is not None and axes.certain and axes.axes == "z backward"
            R_SC = np.diag([1.0, -1.0, -1.0]) if backward else np.eye(3)
            viewpoint = np.zeros(3)
        at_camera = cloud.viewpoint is not None and np.allclose(cloud.viewpoint, viewpoint)
        points_C = (cloud.points - viewpoint) @ R_SC
        if at_camera and points_C[:, 2].min() > 0.0:
            rays = points_C[:, :2] / points_C[:, 2:]
            camera = None if cloud.camera is None else DepthCamera.read(cloud.camera)
            found = _camera_pixels(rays, camera) if camera else None
            if found is not None and camera is not None:
                shape = (camera.height, camera.width)
                return cls._of_pixels(cloud, found, shape, R_SC, viewpoint, camera=camera)
            lattice = _lattice_pixels(rays)
            if lattice is not None:
                pixel, shape = lattice
                return cls._of_pixels(cloud, pixel, shape, R_SC, viewpoint)
        return cls._on_grid(cloud)

    @classmethod
    def _on_grid(cls, cloud: PointCloud) -> SceneImage:
        """Return the image of a cloud on a grid that is laid over it."""
        viewpoint, up = cloud.viewpoint, cloud.up
        if viewpoint is None:
            forward = -up
            right = perpendicular(up)
            origin = cloud.points.mean(axis=0) + up * (1.0 + np.ptp(cloud.points @ up))
        else:
            middle = np.median(cloud.points, axis=0) - viewpoint
            length = np.linalg.norm(middle)
            forward = middle / length if length > 1e-6 else -up
            right = np.cross(forward, up)
            if np.linalg.norm(right) < 0.05:
                right = perpendicular(forward)
            origin = viewpoint
        right = right / np.linalg.norm(right)
        R_SC = np.stack([right, np.cross(forward, right), forward], axis=1)
        points_C = (cloud.points - origin) @ R_SC
        front = points_C[:, 2] > 0.02 * np.median(np.abs(points_C[:, 2]))
        if viewpoint is None:
            flat = points_C[:, :2]
        else:
            flat = points_C[:, :2] / np.where(front, points_C[:, 2], 1.0)[:, None]
            front &= (np.abs(flat) < 5.0).all(axis=1)
        if not front.any():
            raise InputError(
                "no point of the cloud is in front of its viewpoint; give the sensor's position "
                "(`viewpoint`, --viewpoint)"
            )
        cell = _cell(flat[front])
        pixel = np.floor((flat - flat[front].min(axis=0)) / cell).astype(np.int64)[:, ::-1]
        pixel[~front] = -1
        height, width = (pixel[front].max(axis=0) + 1).tolist()
        return cls._of_pixels(
            cloud, pixel, (height, width), R_SC, origin, parallel=viewpoint is None, own=False
        )

    @classmethod
    def _of_pixels(
        cls,
        cloud: PointCloud,
        pixel: NDArray[np.int64],
        shape: tuple[int, int],
        R_SC: Array,
        origin: Array,
        *,
        camera: DepthCamera | None = None,
        parallel: bool = False,
        own: bool = True,
    ) -> SceneImage:
        points_C = (cloud.points - origin) @ R_SC
        index = np.full(shape, -1, dtype=np.int64)
        inside = np.flatnonzero(pixel[:, 0] >= 0)
        index[pixel[inside, 0], pixel[inside, 1]] = inside
        if np.count_nonzero(index >= 0) < len(inside):
            # Several points share pixels; nearer ones are written last.
            inside = inside[np.argsort(-points_C[inside, 2], kind="stable")]
            index[pixel[inside, 0], pixel[inside, 1]] = inside
        on_image = points_C[index]
        on_image[index < 0] = np.nan
        _fill_single_pixels(on_image)
        viewpoint = None if parallel else origin
        return cls(cloud, index, pixel, on_image, R_SC, origin, viewpoint, camera, own)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.index.shape[0], self.index.shape[1]

    def pixels_of(self, points_C: Array) -> Array:
        """Return row and column (N, 2), not rounded, of points (N, 3) in the image frame."""
        flat = points_C[:, :2]
        if self.viewpoint is not None:
            flat = flat / points_C[:, 2:]
        camera = self.camera
        if camera is not None:
            if any(camera.distortion):
                flat = distort(camera.distortion_model, camera.distortion, flat)
            return (flat * [camera.fx, camera.fy] + [camera.cx, camera.cy])[:, ::-1]
        return np.stack([np.polyval(line, flat[:, 1 - k]) for k, line in enumerate(self._lines)], 1)

    @cached_property
    def _lines(self) -> list[Array]:
        """Linear maps from y to the row and from x to the column."""
        known = self.index >= 0
        chosen = self.points_C[known][::7]
        flat = chosen[:, :2] if self.viewpoint is None else chosen[:, :2] / chosen[:, 2:]
        places = np.argwhere(known)[::7]
        return [np.polyfit(flat[:, 1 - k], places[:, k], 1) for k in range(2)]

    def on_pixels(self, values: NDArray, nothing: float) -> NDArray:
        """Return values (N, ...) of the points as an image (H, W, ...)."""
        image = values[self.index]
        image[self.index < 0] = nothing
        return image


def _camera_pixels(rays: Array, camera: DepthCamera) -> NDArray[np.int64] | None:
    """Return row and column (N, 2) of rays x/z, y/z (N, 2); None if they are not on the pixels."""
    if any(camera.distortion):
        rays = distort(camera.distortion_model, camera.distortion, rays)
    places = rays * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    pixel = np.rint(places)
    near = (np.abs(places - pixel) < _ON_PIXEL).all(axis=1)
    near &= (pixel >= 0).all(axis=1) & (pixel < [camera.width, camera.height]).all(axis=1)
    if near.mean() < 0.98:
        return None
    pixel[~near] = -1
    return pixel[:, ::-1].astype(np.int64)


def _lattice_pixels(rays: Array) -> tuple[NDArray[np.int64], tuple[int, int]] | None:
    """Return row and column (N, 2) and the image's shape for rays on a lattice; else None."""
    columns = []
    for values in rays.T:
        step = lattice_step(values)
        if step is None:
            return None
        number = np.rint((values - values.min()) / step)
        # Least squares refine the step over the whole width.
        slope, start = np.polyfit(number, values, 1)
        number = np.rint((values - start) / slope)
        if (np.abs((values - start) / slope - number) > _ON_PIXEL).mean() > 0.02:
            return None
        columns.append((number - number.min()).astype(np.int64))
    pixel = np.stack(columns[::-1], axis=1)
    height, width = (pixel.max(axis=0) + 1).tolist()
    return None if max(height, width) > 4 * _MAX_SIDE else (pixel, (height, width))


def _cell(flat: Array) -> float:
    """Return the side of the cells in which points (N, 2) have `_POINTS_PER_PIXEL` neighbours."""
    lower, size = flat.min(axis=0), np.ptp(flat, axis=0)
    cell = max(float(size.max()) / _MAX_SIDE, float(np.sqrt(np.prod(size) / len(flat))), 1e-9)
    while True:
        column, row = np.floor((flat - lower) / cell).astype(np.int64).T
        width = int(column.max()) + 1
        occupied = np.count_nonzero(np.bincount(row * width + column))
        if len(flat) >= _POINTS_PER_PIXEL * occupied:
            return cell
        cell *= 1.1


def _fill_single_pixels(points_C: Array) -> None:
    """Give pixels (H, W, 3) without a point the mean of their neighbours, in place."""
    import cv2

    empty = ~np.isfinite(points_C[..., 0])
    if not empty.any():
        return
    known = np.where(empty[..., None], 0.0, points_C)

    def window_sum(image: Array) -> Array:
        border = cv2.BORDER_CONSTANT
        total = cv2.boxFilter(image, cv2.CV_64F, (3, 3), normalize=False, borderType=border)
        return np.asarray(total, dtype=np.float64)

    count = window_sum((~empty).astype(np.float64))
    filled = empty & (count >= _FILLED_NEIGHBOURS)
    points_C[filled] = window_sum(known)[filled] / count[filled][:, None]
