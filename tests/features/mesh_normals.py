"""Normals of the mesh under a feature: the oracle for normals estimated from points."""

import numpy as np
import open3d as o3d


def closest_normals(mesh, points):
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    return scene.compute_closest_points(points.astype(np.float32))["primitive_normals"].numpy()


def thickness(mesh, points, normals):
    """Return the thickness of the mesh below each point, against the outward normal [m]."""
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32))
    surface = scene.compute_closest_points(points.astype(np.float32))["points"].numpy()
    rays = np.concatenate([surface - 1e-4 * normals, -normals], axis=1).astype(np.float32)
    return scene.cast_rays(rays)["t_hit"].numpy()
