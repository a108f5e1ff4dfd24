"""A depth image of boxes on a floor, as files for the commands; ray by ray in NumPy."""

import numpy as np
import yaml
from PIL import Image

from drake_aerial import DepthCamera

CAMERA = DepthCamera(640, 480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
EYE = np.array([0.0, -1.0, 0.8])
FORWARD = -EYE / np.linalg.norm(EYE)
RIGHT = np.array([1.0, 0.0, 0.0])
R_WC = np.stack([RIGHT, np.cross(FORWARD, RIGHT), FORWARD], axis=1)
UP_C = R_WC.T @ [0.0, 0.0, 1.0]
LARGE = ((-0.2, 0.0), (0.3, 0.2, 0.15))
SMALL = ((0.25, 0.05), (0.12, 0.16, 0.1))


def depths(boxes, floor=True):
    """Return the depths (480, 640) [m] of boxes ((x, y), (length, width, height)) on z = 0."""
    rays = np.dstack([CAMERA.rays(), np.ones((480, 640))]) @ R_WC.T
    found = np.where(rays[..., 2] < 0.0, -EYE[2] / rays[..., 2], np.inf)
    found = found if floor else np.full(found.shape, np.inf)
    for (x, y), (length, width, height) in boxes:
        lower = np.array([x - length / 2, y - width / 2, 0.0]) - EYE
        upper = np.array([x + length / 2, y + width / 2, height]) - EYE
        with np.errstate(divide="ignore", invalid="ignore"):
            slabs = np.sort([lower / rays, upper / rays], axis=0)
        enter, leave = slabs[0].max(axis=-1), slabs[1].min(axis=-1)
        found = np.where(enter < leave, np.minimum(found, enter), found)
    return np.where(found < 5.0, found, 0.0)


def top_middle_C(parcel):
    """Return the middle (3,) of a box's top in the camera's axes [m]."""
    (x, y), size = parcel
    return R_WC.T @ (np.array([x, y, size[2]]) - EYE)


def pixel_of(p_C):
    """Return the column and row that show a point."""
    return p_C[:2] / p_C[2] * [CAMERA.fx, CAMERA.fy] + [CAMERA.cx, CAMERA.cy]


def write(folder, boxes, floor=True):
    """Write scene.png and camera.yaml, and return the arguments that read them."""
    millimetres = np.round(1000.0 * depths(boxes, floor)).astype(np.uint16)
    Image.fromarray(millimetres).save(folder / "scene.png")
    (folder / "camera.yaml").write_text(yaml.safe_dump(CAMERA.to_dict()))
    return [str(folder / "scene.png"), "--camera", str(folder / "camera.yaml")]
