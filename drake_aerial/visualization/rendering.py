"""Rendering of a coloured mesh to an image, without a screen, by Drake's VTK engine."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.geometry import Array
from drake_aerial.visualization.colored_mesh import ColoredMesh

_FOV_Y = 0.5
"""Vertical field of view of the camera [rad]."""


def render(
    mesh: ColoredMesh,
    *,
    size: tuple[int, int] = (640, 480),
    azimuth: float = -0.9,
    elevation: float = 0.55,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    zoom: float = 1.0,
) -> np.ndarray:
    """Return an image (height, width, 3) uint8 of the mesh on white.

    Parameters
    ----------
    mesh : ColoredMesh
        z is up.
    size : (int, int)
        Width and height in pixels.
    azimuth, elevation : float
        Direction from the middle of the bounds to the camera [rad]; azimuth from +x towards +y.
    bounds : pair of (3,) arrays, optional
        Lower and upper corner of the visible box [m]; the whole mesh by default.
    zoom : float
        Above 1 the camera comes nearer.
    """
    nothing = ColoredMesh()
    (image,) = render_over(
        mesh,
        [nothing],
        size=size,
        azimuth=azimuth,
        elevation=elevation,
        bounds=bounds,
        zoom=zoom,
    )
    return image


def render_over(
    base: ColoredMesh,
    meshes: Iterable[ColoredMesh],
    *,
    size: tuple[int, int] = (640, 480),
    azimuth: float = -0.9,
    elevation: float = 0.55,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    zoom: float = 1.0,
) -> list[np.ndarray]:
    """Return an image (height, width, 3) uint8 of `base` with each of `meshes`.

    The images are those of `render` for both meshes as one; the base is loaded only once.

    Parameters
    ----------
    base : ColoredMesh
        z is up.
    meshes : iterable of ColoredMesh
        Each is in one image.
    size, azimuth, elevation, zoom
        As in `render`.
    bounds : pair of (3,) arrays, optional
        As in `render`; by default those of the base and the image's own mesh.
    """
    scene_graph, source = _lit_scene(base)
    context = scene_graph.CreateDefaultContext()
    corners = [np.asarray(b, float) for b in (base.bounds() if bounds is None else bounds)]
    images = []
    for mesh in meshes:
        added, (low, high) = None, corners
        if len(mesh.vertices):
            added = scene_graph.RegisterGeometry(
                context, source, scene_graph.world_frame_id(), _geometry(mesh, "over")
            )
            if bounds is None:
                own = mesh.bounds()
                low, high = np.minimum(low, own[0]), np.maximum(high, own[1])
        camera, X_WC = _camera(low, high, size, azimuth, elevation, zoom)
        query = scene_graph.get_query_output_port().Eval(context)
        image = query.RenderColorImage(camera, scene_graph.world_frame_id(), X_WC)
        images.append(np.array(image.data[:, :, :3]))
        if added is not None:
            scene_graph.RemoveGeometry(context, source, added)
    return images


def _camera(
    low: Array, high: Array, size: tuple[int, int], azimuth: float, elevation: float, zoom: float
) -> tuple[Any, Any]:
    """Return a camera that sees the box from `low` to `high` (3,) [m], and its pose X_WC."""
    from pydrake.geometry import ClippingRange, ColorRenderCamera, RenderCameraCore
    from pydrake.math import RigidTransform
    from pydrake.systems.sensors import CameraInfo

    radius = 0.5 * float(np.linalg.norm(high - low))
    width, height = size
    narrow = min(_FOV_Y, 2.0 * np.arctan(np.tan(0.5 * _FOV_Y) * width / height))
    distance = max(radius, 1e-3) / np.sin(0.5 * narrow) / zoom
    core = RenderCameraCore(
        "vtk",
        CameraInfo(width=width, height=height, fov_y=_FOV_Y),
        ClippingRange(max(0.01, distance - 3.0 * radius), distance + 3.0 * radius + 0.02),
        RigidTransform(),
    )
    return ColorRenderCamera(core), _camera_pose(0.5 * (low + high), distance, azimuth, elevation)


def _camera_pose(center: Array, distance: float, azimuth: float, elevation: float) -> Any:
    """Return the pose X_WC of a camera that looks at `center` (3,) [m], z into the image."""
    from pydrake.math import RigidTransform, RotationMatrix

    level = np.cos(elevation)
    back = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    R_WC = RotationMatrix(np.stack([right, -np.cross(back, right), -back], axis=1))
    return RigidTransform(R_WC, center + distance * back)


def _lit_scene(mesh: ColoredMesh) -> tuple[Any, Any]:
    """Return a SceneGraph with the mesh and a renderer "vtk" with two lights, and its source."""
    from pydrake.geometry import (
        LightParameter,
        MakeRenderEngineVtk,
        RenderEngineVtkParams,
        SceneGraph,
    )

    scene_graph = SceneGraph()
    source = scene_graph.RegisterSource("mesh")
    scene_graph.RegisterAnchoredGeometry(source, _geometry(mesh, "mesh"))
    parameters = RenderEngineVtkParams()
    parameters.default_clear_color = [1.0, 1.0, 1.0]
    parameters.lights = [
        LightParameter(type="directional", direction=direction, intensity=light, frame="camera")
        for direction, light in (([-0.35, -0.5, 1.0], 3.4), ([0.6, 0.3, 1.0], 1.8))
    ]
    scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(parameters))
    return scene_graph, source


def _geometry(mesh: ColoredMesh, name: str) -> Any:
    """Return a mesh as a geometry that is rendered."""
    from pydrake.geometry import GeometryInstance, PerceptionProperties, RenderLabel
    from pydrake.math import RigidTransform

    geometry = GeometryInstance(RigidTransform(), mesh.to_drake(), name)
    properties = PerceptionProperties()
    properties.AddProperty("label", "id", RenderLabel(1))
    geometry.set_perception_properties(properties)
    return geometry
