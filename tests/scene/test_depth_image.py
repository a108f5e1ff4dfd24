import cv2
import numpy as np
import open3d as o3d
import pytest
from PIL import Image

from drake_aerial import read_depth_image, read_skill, transfer
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError
from drake_aerial.scene.depth_camera import DepthCamera
from drake_aerial.scene.recorded_scan import read_recorded_scan

CAMERA = DepthCamera(64, 48, fx=60.0, fy=61.0, cx=31.0, cy=24.0)
RNG = np.random.default_rng(0)
# Millimetres; some pixels have no depth.
DEPTH = (1000 + 200 * RNG.random((48, 64))).astype(np.uint16)
DEPTH[:5, :7] = 0
UP = (0.0, -1.0, 0.0)


def by_open3d(depth):
    """The points that Open3D makes of the image, in the order of the pixels."""
    intrinsics = o3d.camera.PinholeCameraIntrinsic(64, 48, 60.0, 61.0, 31.0, 24.0)
    image = o3d.geometry.Image(depth)
    cloud = o3d.geometry.PointCloud.create_from_depth_image(image, intrinsics, depth_scale=1000.0)
    return np.asarray(cloud.points)


def save(path, depth):
    if path.suffix == ".npy":
        np.save(path, depth)
    elif path.stem.endswith("cv2"):
        assert cv2.imwrite(str(path), depth)
    else:
        Image.fromarray(depth).save(path)
    return path


# PNG has whole numbers only.
WHOLE = [(name, False) for name in ("a.png", "a.tif", "a.npy", "by_cv2.png", "by_cv2.tiff")]
METRES = [(name, True) for name in ("a.tif", "a.npy", "by_cv2.tiff")]


@pytest.mark.parametrize(("name", "metres"), WHOLE + METRES)
def test_files(tmp_path, name, metres):
    depth = (DEPTH / 1000).astype(np.float32) if metres else DEPTH
    cloud = read_depth_image(save(tmp_path / name, depth), CAMERA, up=UP)
    np.testing.assert_allclose(cloud.points, by_open3d(DEPTH), atol=1e-6)
    assert cloud.dropped_points == 35
    np.testing.assert_array_equal(cloud.viewpoint, [0, 0, 0])
    np.testing.assert_array_equal(cloud.up, UP)


def test_missing_depths_of_all_kinds_are_dropped():
    depth = DEPTH.astype(np.float32) / 1000
    depth[10, :5] = [np.nan, np.inf, -np.inf, 0.0, -1.0]
    assert read_depth_image(depth, CAMERA).dropped_points == 40
    depth = DEPTH.copy()
    depth[10, :5] = 65535
    assert read_depth_image(depth, CAMERA).dropped_points == 40


def test_the_depth_scale_is_units_per_metre():
    fine = DepthCamera(64, 48, 60.0, 61.0, 31.0, 24.0, depth_scale=10_000.0)
    tenths = read_depth_image(DEPTH.astype(np.uint16) * 10, fine, up=UP)
    np.testing.assert_allclose(tenths.points, by_open3d(DEPTH), atol=1e-6)


def test_up_must_be_given_and_the_image_is_found_again(tmp_path):
    path = save(tmp_path / "a.png", DEPTH)
    with pytest.raises(InputError, match="camera axes; up is unknown"):
        read_depth_image(path, CAMERA).require_up()
    cloud = read_depth_image(path, CAMERA, up=UP)
    cloud.require_up()
    again = read_recorded_scan(cloud.to_record(), path)
    np.testing.assert_array_equal(again.points, cloud.points)
    np.testing.assert_array_equal(again.up, UP)


@pytest.mark.parametrize(
    ("depth", "message"),
    [
        (DEPTH.T, r"is 48 x 64 pixels, but the camera has 64 x 48; give the intrinsics"),
        (DEPTH[::2, ::2], "is 32 x 24 pixels, but the camera has 64 x 48"),
        (np.zeros((48, 64, 3), np.uint8), "must have one depth for each pixel, got shape"),
        (DEPTH.astype(np.uint8), "must hold depths of 16 bits or more, got uint8; is it a colour"),
        (np.zeros((48, 64), np.uint16), "no pixel has a depth"),
        (DEPTH.astype(np.float32), r"the median depth is 1\.\d+e\+03 m at 1 units per metre"),
        (DEPTH / 1e6, "the median depth is 0.0011 m at 1 units per metre; give `depth_scale`"),
    ],
)
def test_impossible_images_are_refused(depth, message):
    with pytest.raises(InputError, match=message):
        read_depth_image(depth, CAMERA)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.jpg", b"x", "is not a depth image; accepted formats are .png .tif"),
        ("a.png", b"x", "cannot read .*a.png: not an image, or of numbers"),
        ("a.png", None, "no such file"),
        ("a.npy", b"x", "not a valid NPY file"),
    ],
)
def test_bad_files_are_refused(tmp_path, name, data, message):
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=message):
        read_depth_image(tmp_path / name, CAMERA)


def test_an_image_without_a_camera_is_refused(tmp_path):
    with pytest.raises(InputError, match="a depth image needs its intrinsics: --camera"):
        PointCloud.read(save(tmp_path / "a.png", DEPTH))


def write_exr(path, **channels):
    OpenEXR = pytest.importorskip("OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(path))
    return path


@pytest.mark.parametrize("channel", ["Z", "Y", "V", "depth.Z", "R"])
@pytest.mark.parametrize(("dtype", "atol"), [(np.float32, 1e-6), (np.float16, 1e-3)])
def test_exr(tmp_path, channel, dtype, atol):
    path = write_exr(tmp_path / "a.exr", **{channel: (DEPTH / 1000).astype(dtype)})
    cloud = read_depth_image(path, CAMERA, up=UP)
    np.testing.assert_allclose(cloud.points, by_open3d(DEPTH), atol=atol)
    assert cloud.dropped_points == 35


def test_the_depth_channel_of_an_exr_with_colours_is_taken(tmp_path):
    grey = np.full(DEPTH.shape, 0.5, np.float32)
    path = write_exr(tmp_path / "a.exr", R=grey, G=grey, B=grey, Z=(DEPTH / 1000).astype("f4"))
    cloud = read_depth_image(path, CAMERA, up=UP)
    np.testing.assert_allclose(cloud.points, by_open3d(DEPTH), atol=1e-6)


def test_whole_numbers_of_an_exr_are_millimetres(tmp_path):
    cloud = read_depth_image(write_exr(tmp_path / "a.exr", Z=DEPTH.astype(np.uint32)), CAMERA)
    np.testing.assert_allclose(cloud.points, by_open3d(DEPTH), atol=1e-6)


def test_an_exr_without_depths_is_refused(tmp_path):
    grey = np.full(DEPTH.shape, 0.5, np.float32)
    with pytest.raises(InputError, match="has no channel Z, only "):
        read_depth_image(write_exr(tmp_path / "a.exr", G=grey, B=grey), CAMERA)
    for data in (b"x", (tmp_path / "a.exr").read_bytes()[:300]):
        (tmp_path / "a.exr").write_bytes(data)
        with pytest.raises(InputError, match=r"cannot read .*a.exr: ") as caught:
            read_depth_image(tmp_path / "a.exr", CAMERA)
        assert "\n" not in str(caught.value)


def test_exr_without_its_library_names_it(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "OpenEXR", None)
    (tmp_path / "a.exr").write_bytes(b"x")
    with pytest.raises(InputError, match="EXR needs OpenEXR; pip install OpenEXR"):
        read_depth_image(tmp_path / "a.exr", CAMERA)


def test_the_contact_is_on_the_top_of_a_box_in_a_depth_image(tmp_path):
    # A box of 0.6 x 0.4 x 0.2 m, by a camera 1.2 m before it and 1 m above its middle.
    camera = DepthCamera(320, 240, fx=300.0, fy=300.0, cx=159.5, cy=119.5)
    eye = np.array([0.0, -1.2, 1.0])
    z = -eye / np.linalg.norm(eye)
    R_WC = np.stack([[1.0, 0, 0], np.cross(z, [1.0, 0, 0]), z], axis=1)
    rays = np.concatenate([camera.rays(), np.ones((240, 320, 1))], axis=-1) @ R_WC.T
    with np.errstate(divide="ignore"):
        entry, leave = ([-0.3, -0.2, -0.1] - eye) / rays, ([0.3, 0.2, 0.1] - eye) / rays
    near, far = np.minimum(entry, leave).max(-1), np.maximum(entry, leave).min(-1)
    depth = np.where(near < far, 1000 * near, 0).round().astype(np.uint16)
    cloud = read_depth_image(save(tmp_path / "box.png", depth), camera, up=R_WC.T @ [0, 0, 1.0])
    best = transfer(read_skill("flat"), cloud, top=1).best
    p_W = R_WC @ best.X_SG.p[0] + eye
    np.testing.assert_allclose(p_W, [0, 0, 0.1], atol=0.03)


@pytest.mark.parametrize("keep", [0.0, 0.5, 0.9])
def test_an_exr_that_is_cut_short_is_refused(tmp_path, keep):
    path = write_exr(tmp_path / "a.exr", Z=(DEPTH / 1000).astype("f4"))
    path.write_bytes(b"x" + path.read_bytes()[: int(keep * path.stat().st_size)][1:])
    with pytest.raises(InputError, match="not an EXR file, or damaged or cut short"):
        read_depth_image(path, CAMERA)
