import cv2
import numpy as np
import pytest
import yaml
from pydrake.systems.sensors import CameraInfo

from drake_aerial.errors import InputError
from drake_aerial.scene.depth_camera import DepthCamera

OURS = {"width": 64, "height": 48, "fx": 60.0, "fy": 61.0, "cx": 31.0, "cy": 24.0}
K = [60.0, 0.0, 31.0, 0.0, 61.0, 24.0, 0.0, 0.0, 1.0]
PLUMB_BOB = [0.1, -0.05, 0.002, -0.001, 0.01]
# As `ros2 topic echo` and the calibration of cameras write it.
MESSAGE = {
    "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "camera"},
    **{"height": 48, "width": 64, "distortion_model": "plumb_bob", "d": PLUMB_BOB, "k": K},
    **{"r": [1.0, 0, 0, 0, 1, 0, 0, 0, 1], "p": [60.0, 0, 31, 0, 0, 61, 24, 0, 0, 0, 1, 0]},
    **{"binning_x": 0, "binning_y": 0, "roi": {"x_offset": 0}},
}
CALIBRATION = {
    **{"image_width": 64, "image_height": 48, "camera_name": "camera"},
    "camera_matrix": {"rows": 3, "cols": 3, "data": K},
    "distortion_model": "plumb_bob",
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": PLUMB_BOB},
}


def write(tmp_path, values):
    path = tmp_path / "camera.yaml"
    path.write_text(yaml.safe_dump(values))
    return path


@pytest.mark.parametrize(
    ("values", "distortion"),
    [(OURS, ()), (OURS | {"distortion": PLUMB_BOB}, PLUMB_BOB)]
    + [(MESSAGE, PLUMB_BOB), (CALIBRATION, PLUMB_BOB)]
    + [({key.upper() if len(key) == 1 else key: v for key, v in MESSAGE.items()}, PLUMB_BOB)],
)
def test_intrinsics_from_files(tmp_path, values, distortion):
    camera = DepthCamera.read(write(tmp_path, values))
    assert camera == DepthCamera(**OURS, distortion=tuple(distortion))
    assert camera == DepthCamera.read(values) == DepthCamera.read(camera)
    # What is recorded is read back.
    assert DepthCamera.read(camera.to_dict()) == camera


def test_drakes_cameras_are_read():
    info = CameraInfo(width=64, height=48, focal_x=60.0, focal_y=61.0, center_x=31.0, center_y=24.0)
    assert DepthCamera.read(info) == DepthCamera(**OURS)


@pytest.mark.parametrize(
    ("model", "coefficients"),
    [
        ("plumb_bob", []),
        ("plumb_bob", PLUMB_BOB),
        ("plumb_bob", PLUMB_BOB[:4]),
        ("rational_polynomial", [0.1, -0.05, 0.002, -0.001, 0.01, 0.1, -0.02, 0.003]),
        ("equidistant", [0.05, -0.01, 0.002, -0.001]),
    ],
)
def test_the_camera_projects_points_on_its_rays_to_their_pixels(model, coefficients):
    camera = DepthCamera(**OURS, distortion_model=model, distortion=tuple(coefficients))
    rays = camera.rays().reshape(-1, 2)
    points = np.c_[rays, np.ones(len(rays))] * np.random.default_rng(0).uniform(
        0.5, 3, (len(rays), 1)
    )
    matrix, zero = np.array(K).reshape(3, 3), np.zeros(3)
    project = cv2.fisheye.projectPoints if model == "equidistant" else cv2.projectPoints
    arguments = (np.array(coefficients or [0.0] * 4),)
    if model == "equidistant":
        pixels, _ = project(points[:, None], zero, zero, matrix, *arguments)
    else:
        pixels, _ = project(points, zero, zero, matrix, *arguments)
    v, u = np.mgrid[:48, :64]
    np.testing.assert_allclose(pixels.reshape(48, 64, 2), np.stack([u, v], -1), atol=1e-4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fx": 1.93}, "`fx` = 1.93 gives a field of view of 173 deg .* focal length in pixels"),
        ({"fx": 60e3}, "gives a field of view of 0.06.* deg"),
        ({"fy": -1.0}, "`fy` must be a positive number of pixels, got -1"),
        ({"cx": 310.0}, "`cx` must be in the image of 64 pixels, got 310; give the intrinsics of"),
        ({"cy": -3.0}, "`cy` must be in the image"),
        ({"width": 0}, "`width` and `height` must be positive"),
        ({"width": 63.5}, "width must be a whole number, got 63.5"),
        ({"depth_scale": 0.0}, "`depth_scale` must be positive, in units per metre, got 0"),
        ({"distortion": [0.1]}, "`distortion` of plumb_bob must have 4 or 5 coefficients, got 1"),
        ({"distortion": [[0.1]]}, "distortion must be"),
        ({"distortion_model": "fov"}, "must be one of plumb_bob, rational_polynomial"),
        ({"fx": "wide"}, "fx must be a .*number, got 'wide'"),
        ({"depth_sclae": 1000}, "unknown key 'depth_sclae'.*did you mean 'depth_scale'"),
    ],
)
def test_impossible_intrinsics_are_refused(tmp_path, changes, message):
    path = write(tmp_path, OURS | changes)
    with pytest.raises(InputError, match=message) as caught:
        DepthCamera.read(path)
    assert str(caught.value).startswith(str(path))


def test_files_without_intrinsics_are_refused(tmp_path):
    with pytest.raises(InputError, match="no intrinsics; give width, height, fx"):
        DepthCamera.read(write(tmp_path, {"width": 64, "height": 48}))
    with pytest.raises(InputError, match="camera matrix must be 9 finite numbers"):
        DepthCamera.read(write(tmp_path, MESSAGE | {"k": K[:8]}))
    with pytest.raises(InputError, match="the key 'cy' is missing"):
        DepthCamera.read(write(tmp_path, {k: v for k, v in OURS.items() if k != "cy"}))
    with pytest.raises(InputError, match="cannot read"):
        DepthCamera.read(tmp_path / "gone.yaml")


@pytest.mark.parametrize("key", ["width", "height", "fx", "fy", "cx", "cy"])
def test_intrinsics_without_a_value_are_refused_by_name(key):
    values = {"width": 64, "height": 48, "fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5, key: None}
    with pytest.raises(InputError, match=f"{key} must be a finite number, got None"):
        DepthCamera.read(values)
