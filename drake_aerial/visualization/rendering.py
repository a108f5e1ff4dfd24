"""Headless rendering of a `Picture` with Drake's VTK engine."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from drake_aerial.visualization.picture import Picture


def render(
    picture: Picture,
    *,
    size: tuple[int, int] = (640, 480),
    azimuth: float = -0.9,
    elevation: float = 0.55,
    bounds: tuple[ArrayLike, ArrayLike] | None = None,
    zoom: float = 1.0,
) -> np.ndarray:
    """Return an image (height, width, 3) uint8 of the picture on white.

    Parameters
    ----------
    picture : Picture
        What to draw; z is up.
    size : (int, int)
        Width and height in pixels.
    azimuth, elevation : float
        Direction from the scene's middle to the camera [rad]; azimuth from +x towards +y.
    bounds : pair of (3,) arrays, optional
        What must be in view [m]; the whole picture by default.
    zoom : float
        Above 1 the camera comes nearer.
    """
    from pydrake.geometry import (
        ClippingRange,
        ColorRenderCamera,
        GeometryInstance,
        LightParameter,
        MakeRenderEngineVtk,
        Mesh,
        PerceptionProperties,
        RenderCameraCore,
        RenderEngineVtkParams,
        RenderLabel,
        SceneGraph,
    )
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.systems.sensors import CameraInfo

    low, high = (np.asarray(b, float) for b in (picture.bounds() if bounds is None else bounds))
    center, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    fov_y = 0.5
    width, height = size
    narrow = min(fov_y, 2.0 * np.arctan(np.tan(0.5 * fov_y) * width / height))
    distance = max(radius, 1e-3) / np.sin(0.5 * narrow) / zoom

    back = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    R_WC = RotationMatrix(np.stack([right, -np.cross(back, right), -back], axis=1))
    X_WC = RigidTransform(R_WC, center + distance * back)

    with tempfile.TemporaryDirectory() as folder:
        # The engine reads .gltf by name only; a .glb inside it would be refused.
        path = Path(folder) / "picture.gltf"
        write_gltf(picture, path)
        scene_graph = SceneGraph()
        source = scene_graph.RegisterSource("picture")
        geometry = GeometryInstance(RigidTransform(), Mesh(str(path)), "picture")
        properties = PerceptionProperties()
        properties.AddProperty("label", "id", RenderLabel(1))
        geometry.set_perception_properties(properties)
        scene_graph.RegisterAnchoredGeometry(source, geometry)
        parameters = RenderEngineVtkParams()
        parameters.default_clear_color = [1.0, 1.0, 1.0]
        parameters.lights = [
            LightParameter(
                type="directional", direction=[-0.35, -0.5, 1.0], intensity=3.4, frame="camera"
            ),
            LightParameter(
                type="directional", direction=[0.6, 0.3, 1.0], intensity=1.8, frame="camera"
            ),
        ]
        scene_graph.AddRenderer("vtk", MakeRenderEngineVtk(parameters))
        camera = ColorRenderCamera(
            RenderCameraCore(
                "vtk",
                CameraInfo(width=width, height=height, fov_y=fov_y),
                ClippingRange(max(0.01, distance - 3.0 * radius), distance + 3.0 * radius + 0.02),
                RigidTransform(),
            )
        )
        query = scene_graph.get_query_output_port().Eval(scene_graph.CreateDefaultContext())
        image = query.RenderColorImage(camera, scene_graph.world_frame_id(), X_WC)
    return np.array(image.data[:, :, :3])


def write_gltf(picture: Picture, path: Path) -> None:
    """Write the picture as .gltf with its buffer embedded as base64."""
    import base64
    import json
    import struct

    glb = picture.to_glb()
    (text_size,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + text_size])
    body = glb[28 + text_size :]
    document["buffers"][0]["uri"] = (
        "data:application/octet-stream;base64," + base64.b64encode(body).decode()
    )
    path.write_text(json.dumps(document))
