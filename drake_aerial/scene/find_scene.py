"""Find gravity, supports and objects in a scene's cloud."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.geometry import Array, matrix_from_quat, quat_from_two_vectors
from drake_aerial.scene.gravity import (
    angle_deg,
    direction_uncertainty_deg,
    unit_vector,
    up_from_planes,
)
from drake_aerial.scene.objects import find_labels
from drake_aerial.scene.outline import find_outline
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.parts import find_ground
from drake_aerial.scene.scene import FIRST_OBJECT, Gravity, GravitySource, Scene, Support
from drake_aerial.scene.scene_image import SceneImage
from drake_aerial.scene.scene_objects import describe_objects, one_object, point_labels
from drake_aerial.scene.supports import find_supports, find_walls
from drake_aerial.scene.surfaces import Plane, Surfaces

# Planar faces have at least this share of the scene's points.
_LEAST_FACE = 0.004
# Directions that differ by more [deg] are reported.
_DISAGREEMENT = 3.0
# A given direction may be wrong by this angle [deg] and the support is still looked for.
_MOST_WRONG = 45.0
# Direction of an accelerometer at rest: bias and mounting [deg].
_IMU_DEG = 1.0
# Points farther below a plane than this [m] are its underside, if they are this share of its own.
_UNDERSIDE, _UNDERSIDE_SHARE = 0.01, 0.3
# A scene is only a plane if at least this share of its points are on it.
_ONLY_PLANE = 0.98
# An object fills the image if it covers at least this share of this many borders.
_BORDER_SHARE, _BORDERS = 0.5, 3


def find_scene(
    source: PointCloud | SceneImage,
    *,
    up: ArrayLike | None = None,
    imu: ArrayLike | None = None,
    parameters: SceneParameters | None = None,
) -> Scene:
    """Return the gravity, supports and objects of a cloud.

    The answer is deterministic and turns with the cloud. A cloud without a support, such as the
    scan of one object, is one object.

    Parameters
    ----------
    source : PointCloud or SceneImage
        A depth image's cloud (`read_depth_image`), a cloud with a viewpoint, or one of fused views.
    up : (3,) array, optional
        Direction against gravity in S; by default the cloud's own where it is known.
    imu : (3,) array, optional
        Specific force of an accelerometer at rest in S, which points up; any length. It is used if
        no direction is given.
    parameters : SceneParameters, optional

    Raises
    ------
    InputError
        If the scene is only a plane, nothing stands on the support, an object fills the image, or
        the direction of gravity cannot be found.

    Examples
    --------
    >>> import numpy as np
    >>> from drake_aerial import DepthCamera, find_scene, read_depth_image
    >>> depth = np.full((120, 160), 1.5)  # a floor, seen from 1.5 m above
    >>> depth[40:80, 60:110] = 1.2  # a box
    >>> camera = DepthCamera(160, 120, fx=130.0, fy=130.0, cx=79.5, cy=59.5)
    >>> scene = find_scene(read_depth_image(depth, camera))
    >>> len(scene.objects), scene.gravity.up.round(3).tolist()
    (1, [0.0, 0.0, -1.0])
    >>> scene.objects[0].box.size.round(2).tolist()
    [0.45, 0.36, 0.0]
    """
    parameters = parameters or SceneParameters()
    image = source if isinstance(source, SceneImage) else SceneImage.of_cloud(source)
    cloud = image.cloud
    if up is not None:
        given_S: Array | None = unit_vector(up, "up")
    else:
        given_S = cloud.up if cloud.up_is_known else None
    imu_S = None if imu is None else unit_vector(imu, "imu")
    surfaces = Surfaces.of_image(image, parameters)
    faces = surfaces.faces(_LEAST_FACE)
    known_S = given_S if given_S is not None else imu_S
    up_C = image.R_SC.T @ known_S if known_S is not None else up_from_planes(faces, surfaces)
    supports = find_supports(faces, up_C, surfaces, parameters.min_height)
    if not supports and known_S is not None and image.has_own_pixels and faces:
        # A wrong direction is reported, together with the support that contradicts it.
        other_C = up_from_planes(faces, surfaces)
        if angle_deg(other_C, up_C) < _MOST_WRONG:
            supports = find_supports(faces, other_C, surfaces, parameters.min_height)
    if not image.has_own_pixels and supports and _has_underside(supports, up_C, image):
        supports = []
    if not supports:
        _check_without_support(image, surfaces, faces, known_S is not None)
        gravity = _gravity(given_S, imu_S, None, image)
        return one_object(image, gravity)
    uncertain = [direction_uncertainty_deg(face, surfaces) for face in supports]
    gravity = _gravity(given_S, imu_S, (supports[0], uncertain[0]), image)
    up_C = image.R_SC.T @ gravity.up
    R_UC = matrix_from_quat(quat_from_two_vectors(up_C, np.array([0.0, 0.0, 1.0])))
    walls = find_walls(faces, supports[0], surfaces)
    ground = find_ground(supports, walls, surfaces)
    on_pixels = find_labels(image, surfaces, ground, R_UC, parameters)
    if on_pixels.max() < FIRST_OBJECT:
        if not image.has_own_pixels:
            return one_object(image, _gravity(given_S, imu_S, None, image))
        raise InputError(
            f"nothing stands on the support: things must be {parameters.min_height:g} m high and "
            f"cover {parameters.min_pixels} pixels; take the image from nearer"
        )
    labels = point_labels(image, surfaces, on_pixels, supports, up_C)
    outline = find_outline(on_pixels, surfaces, up_C)
    described = tuple(
        _support(face, deviation, image, surfaces, on_pixels)
        for face, deviation in zip(supports, uncertain, strict=True)
    )
    objects = describe_objects(image, surfaces, labels, outline, gravity.up, described)
    return Scene(image, gravity, described, objects, labels)


def _has_underside(supports: list[Plane], up_C: Array, image: SceneImage) -> bool:
    """Return whether a scan has points below its lowest support: it is an object's own face."""
    lowest = min(supports, key=lambda face: face.offset / float(face.normal @ up_C))
    points = (image.cloud.points - image.origin) @ image.R_SC
    height = points @ lowest.normal - lowest.offset
    below = np.count_nonzero(height < -_UNDERSIDE)
    return bool(below > _UNDERSIDE_SHARE * np.count_nonzero(np.abs(height) <= _UNDERSIDE))


def _gravity(
    given_S: Array | None,
    imu_S: Array | None,
    support: tuple[Plane, float] | None,
    image: SceneImage,
) -> Gravity:
    """Return the direction to use, and how far the others are from it."""
    sources: list[tuple[GravitySource, Array, float]] = []
    if given_S is not None:
        sources.append((GravitySource.GIVEN, given_S, 0.0))
    if imu_S is not None:
        sources.append((GravitySource.IMU, imu_S, _IMU_DEG))
    if support is not None:
        face, deviation = support
        sources.append((GravitySource.SUPPORT, image.R_SC @ face.normal, deviation))
    source, direction, uncertainty = sources[0]
    angles = [(angle_deg(direction, other), name) for name, other, _ in sources[1:]]
    if not angles:
        return Gravity(direction, source, uncertainty)
    largest, name = max(angles)
    warning = None
    if largest > _DISAGREEMENT:
        shown = {"given": "the given `up`", "imu": "the IMU", "support": "the support's normal"}
        warning = (
            f"{shown[source]} and {shown[name]} differ by {largest:.1f} deg; {shown[source]} is "
            "used; check `up`, or whether the support is level"
        )
    return Gravity(direction, source, uncertainty, largest, warning)


def _check_without_support(
    image: SceneImage, surfaces: Surfaces, faces: list[Plane], up_is_known: bool
) -> None:
    """Refuse a camera's image in which no support is found, unless it shows one whole object.

    Raises
    ------
    InputError
        If the scene is only a plane, an object fills the image, or gravity is unknown.
    """
    if image.has_own_pixels:
        seen = surfaces.seen
        if faces and faces[0].pixels.sum() > _ONLY_PLANE * np.count_nonzero(seen):
            raise InputError(
                "the scene is only a plane with nothing on it; point the camera at the object, "
                "from where its sides are seen"
            )
        rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
        inner = seen[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        borders = [inner[0], inner[-1], inner[:, 0], inner[:, -1]]
        full = inner.shape == seen.shape
        if full and sum(border.mean() > _BORDER_SHARE for border in borders) >= _BORDERS:
            raise InputError(
                "an object fills the image and no floor or table is seen; take the image from "
                "farther away"
            )
    if not up_is_known:
        raise InputError(
            "no plane that things stand on is seen and the direction of gravity is unknown; "
            "give --up X Y Z, or take the image with more of the floor or table"
        )


def _support(
    face: Plane,
    uncertainty_deg: float,
    image: SceneImage,
    surfaces: Surfaces,
    labels: NDArray[np.int64],
) -> Support:
    """Return a support in the cloud's frame."""
    normal = image.R_SC @ face.normal
    origin = image.origin
    on_face = (labels == 1) & surfaces.on_plane(face.normal, face.offset)
    indices = image.index[on_face]
    return Support(
        normal,
        face.offset + float(normal @ origin),
        uncertainty_deg,
        indices[indices >= 0],
    )
