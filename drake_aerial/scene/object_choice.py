"""Choose one object of a scene; a scan of one clean object is left as it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.cloud.assumptions import Assumption, AssumptionKind
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.features.horizontal_hull import HorizontalHull
from drake_aerial.scene.depth_camera import DepthCamera
from drake_aerial.scene.find_scene import find_scene
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.scene.scene import GravitySource, Scene, SceneObject

# A cloud in world axes is a scene only if at most this share of its points is lower than its
# lowest support, by more than this height [m]. An object's own sides are below its top.
_MOST_BELOW, _BELOW = 0.05, 0.03
# Width of the border [pixels] that is empty around an object that was cut out of its image.
_BORDER = 2.0
# A scan is a bare plane if at least this share of its points is within this distance [m] of a plane
# of more than this area [m^2].
_ONLY_PLANE, _PLANE_THICKNESS, _LARGEST_PLANE = 0.98, 0.01, 1.0


class ObjectsNotChosenError(InputError):
    """Several objects, and none is chosen.

    Attributes
    ----------
    scene : Scene
        The scene with the objects.
    """

    def __init__(self, scene: Scene):
        super().__init__(
            f"the scene has {len(scene.objects)} objects and none is chosen; give --object N, "
            "--pixel U V or --at X Y Z (`drake-aerial scene` shows them)"
        )
        self.scene = scene


@dataclass(frozen=True)
class ObjectChoice:
    """Choice of an object by number, pixel or point; without a choice, the only object.

    Attributes
    ----------
    number : int or None
        The object's number in the scene, 2 and up.
    pixel : (float, float) or None
        A pixel on the object: column and row.
    point : (float, float, float) or None
        A point on the object, in the cloud's frame S [m].
    whole : bool
        Whether the whole scan is the object, whatever is seen in it.
    """

    number: int | None = None
    pixel: tuple[float, float] | None = None
    point: tuple[float, float, float] | None = None
    whole: bool = False

    def __post_init__(self) -> None:
        """Check that at most one way is used.

        Raises
        ------
        InputError
            If the object is chosen in more than one way.
        """
        given = [
            name
            for name, value in (
                ("object", self.number),
                ("pixel", self.pixel),
                ("at", self.point),
                ("whole", self.whole or None),
            )
            if value is not None
        ]
        if len(given) > 1:
            raise InputError(f"an object must be chosen in one way only, got {', '.join(given)}")

    def __bool__(self) -> bool:
        return any(value is not None for value in (self.number, self.pixel, self.point))

    def of(self, scene: Scene) -> SceneObject:
        """Return the chosen object of a scene, or its only one.

        Raises
        ------
        ObjectsNotChosenError
            If there are several and none is chosen.
        InputError
            If there is no such object.
        """
        if self.number is not None:
            return scene.object_of(self.number)
        if self.pixel is not None:
            return scene.object_at_pixel(*self.pixel)
        if self.point is not None:
            return scene.object_at(self.point)
        if len(scene.objects) > 1:
            raise ObjectsNotChosenError(scene)
        return scene.objects[0]


def chosen_object(
    cloud: PointCloud,
    choice: ObjectChoice | None = None,
    *,
    imu: ArrayLike | None = None,
    parameters: SceneParameters | None = None,
) -> PointCloud:
    """Return the cloud of the chosen object of a scene.

    A cloud in a camera's own axes is a scene. Another cloud is one if something stands on a support
    in it, and hardly anything is lower than the support; otherwise it is one clean object, and
    returned as it is.

    Parameters
    ----------
    cloud : PointCloud
        A scan or scene, in its frame S.
    choice : ObjectChoice, optional
        The object; by default the only one.
    imu : (3,) array, optional
        Specific force of an accelerometer at rest, in S; see `find_scene`.
    parameters : SceneParameters, optional

    Raises
    ------
    ObjectsNotChosenError
        If there are several objects and none is chosen.
    InputError
        If there is no such object, or the scene holds none.
    """
    choice = ObjectChoice() if choice is None else choice
    if choice.whole:
        return cloud
    try:
        scene = find_scene(cloud, imu=imu, parameters=parameters)
    except InputError:
        if choice or not is_cut_out(cloud):
            raise
        check_not_a_bare_plane(cloud)
        return cloud
    if scene.is_one_object and not (choice or is_camera_view(cloud)):
        check_not_a_bare_plane(cloud)
    if scene.is_one_object or not (choice or is_scene(scene)):
        if choice:
            choice.of(scene)
        return cloud
    return object_cloud(scene, choice.of(scene).number)


def check_not_a_bare_plane(cloud: PointCloud) -> None:
    """Refuse a scan that is a plane larger than a payload, such as a bare table.

    Raises
    ------
    InputError
        If nearly all points lie on one plane of more than 1 m^2.
    """
    offset = cloud.points - cloud.centroid
    _, axes = np.linalg.eigh(offset.T @ offset)
    if np.mean(np.abs(offset @ axes[:, 0]) < _PLANE_THICKNESS) < _ONLY_PLANE:
        return
    area = HorizontalHull.of_points(offset @ axes[:, 1:]).area
    if area > _LARGEST_PLANE:
        raise InputError(
            f"the scan is one plane of {area:.1f} m^2 with nothing on it; scan the payload from "
            "where its sides are seen, or give --whole if the plane is the payload"
        )


def is_camera_view(cloud: PointCloud) -> bool:
    """Return whether a cloud is one camera's view in the camera's own axes."""
    return cloud.camera is not None or any(
        assumption.kind is AssumptionKind.AXES for assumption in cloud.assumptions
    )


def is_cut_out(cloud: PointCloud) -> bool:
    """Return whether a cloud may be one object without its surroundings.

    A camera's view may be if its depth image is known and is empty along all borders.
    """
    if not is_camera_view(cloud):
        return True
    if cloud.camera is None:
        return False
    camera, (x, y, z) = DepthCamera.read(cloud.camera), cloud.points.T
    u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
    inside = (u > _BORDER) & (u < camera.width - 1 - _BORDER)
    return bool((inside & (v > _BORDER) & (v < camera.height - 1 - _BORDER)).all())


def is_scene(scene: Scene) -> bool:
    """Return whether a cloud shows things on a support, rather than one object with flat parts."""
    if is_camera_view(scene.cloud):
        return True
    if not scene.supports:
        return False
    # A point below all supports has its largest height over one of them below zero.
    height = np.max([support.height(scene.cloud.points) for support in scene.supports], axis=0)
    return bool(np.mean(height < -_BELOW) <= _MOST_BELOW)


def object_cloud(scene: Scene, number: int) -> PointCloud:
    """Return an object's cloud; its record holds the number of the object in the scene."""
    cloud = scene.cloud_of(number)
    if scene.is_one_object:
        return cloud
    whole = scene.cloud
    record: dict[str, Any] = {
        "number": number,
        "of": len(scene.objects),
        "scene_points": len(whole),
        "scene_up": whole.up.tolist() if whole.up_is_known else None,
        "gravity": scene.to_record()["gravity"],
    }
    gravity = scene.gravity
    said = [
        Assumption(
            AssumptionKind.SCENE,
            f"the scan is a scene of {len(scene.objects)} object(s); the payload is object "
            f"{number} ({len(cloud)} of {len(whole)} points; --whole: take all points)",
        )
    ]
    if gravity.source is not GravitySource.GIVEN:
        up = " ".join(f"{x:+.4f}" for x in gravity.up)
        source = "from the support's normal"
        if gravity.source is GravitySource.IMU:
            source = "by the IMU"
        text = f"{up}, {source}, to {gravity.uncertainty_deg:.2f} deg"
        said.append(Assumption(AssumptionKind.UP, text))
    if gravity.warning is not None:
        said.append(Assumption(AssumptionKind.UP, gravity.warning))
    # What the scene found replaces what was unknown before.
    kept = tuple(
        a for a in cloud.assumptions if not (a.kind is AssumptionKind.UP and not whole.up_is_known)
    )
    return replace(cloud, assumptions=kept + tuple(said), scene_object=record)


def recorded_object(cloud: PointCloud, record: dict[str, Any]) -> PointCloud:
    """Return the object of a scene that a result's record names, from the whole scene's cloud."""
    return object_cloud(find_scene(cloud), int(record["number"]))
