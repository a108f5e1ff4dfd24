"""Depth images, intrinsics, text clouds and bags, damaged or with impossible values."""

import io
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import yaml
from hypothesis import strategies as st

from tests.fuzz.hostile import VALUES, damage

RNG = np.random.default_rng(0)
DEPTH = RNG.integers(800, 1200, (24, 32)).astype(np.uint16)
CAMERA = {"width": 32, "height": 24, "fx": 30.0, "fy": 30.0, "cx": 15.5, "cy": 11.5}
CAMERA_INFO = {
    "image_width": 32,
    "image_height": 24,
    "camera_matrix": {"rows": 3, "cols": 3, "data": [30.0, 0, 15.5, 0, 30.0, 11.5, 0, 0, 1]},
    "distortion_model": "plumb_bob",
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0.1, -0.05, 0.001, 0, 0]},
}
EXTREME = st.sampled_from([0, 1, 2, 3, 7, 24, 255, 65535, 2**31 - 1, 2**32 - 1])


@cache
def image_file(suffix):
    """The bytes of a valid depth image."""
    if suffix == ".npy":
        data = io.BytesIO()
        np.save(data, DEPTH)
        return data.getvalue()
    if suffix == ".exr":
        import OpenEXR

        path = Path(tempfile.mkdtemp(prefix="fuzz_")) / "a.exr"
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"Z": DEPTH.astype("f4") / 1000}).write(str(path))
        return path.read_bytes()
    from PIL import Image

    data = io.BytesIO()
    values = DEPTH.astype("f4") / 1000 if suffix == ".tiff" else DEPTH
    Image.fromarray(values).save(data, "PNG" if suffix == ".png" else "TIFF")
    return data.getvalue()


@st.composite
def image_files(draw):
    """Suffix and bytes of a depth image, and of its intrinsics; whether both are untouched."""
    suffix = draw(st.sampled_from([".png", ".tif", ".tiff", ".npy", ".exr"]))
    good = image_file(suffix)
    image = draw(damage(good)) if draw(st.booleans()) else good
    camera = dict(draw(st.sampled_from([CAMERA, CAMERA_INFO])))
    for key in draw(st.lists(st.sampled_from([*camera, "depth_scale", "fx"]), max_size=2)):
        camera[key] = draw(VALUES)
    plain = yaml.safe_dump(camera).encode()
    text = draw(damage(plain)) if draw(st.integers(0, 3)) == 0 else plain
    return suffix, image, text, image == good and camera in (CAMERA, CAMERA_INFO) and text == plain


WORDS = st.one_of(
    st.floats(-1.0, 1.0).map(repr),
    st.sampled_from(
        ["nan", "inf", "-inf", "1e400", "0x10", "1_0", "1,5", "--", ".", "+", "1.2.3", "1e", "5d0"]
    ),
    st.sampled_from(["\u0663", "x", "\x00", "\ufeff", "#", "//", '"', "''", "null"]),
)


@st.composite
def text_clouds(draw):
    """Suffix and bytes of a text file, and its points if it is untouched, else None."""
    suffix = draw(st.sampled_from([".xyz", ".txt", ".csv", ".pts", ".asc"]))
    separator = draw(st.sampled_from([" ", ",", ";", "\t", "  ", ", ", "; "]))
    ending = draw(st.sampled_from(["\n", "\r\n", "\n\n", "\r"]))
    points = np.random.default_rng(draw(st.integers(0, 9))).uniform(-0.3, 0.3, (60, 3))
    rows = [[repr(float(value)) for value in row] for row in points]
    extra = draw(st.integers(0, 2))
    rows = [row + ["7"] * extra for row in rows]
    untouched = True
    for _ in range(draw(st.sampled_from([0, 0, 1, 3]))):
        row = rows[draw(st.integers(0, len(rows) - 1))]
        how = draw(st.sampled_from(["word", "fewer", "more"]))
        if how == "word":
            row[draw(st.integers(0, len(row) - 1))] = draw(WORDS)
        elif how == "fewer":
            del row[-1:]
        else:
            row.append(draw(WORDS))
        untouched = False
        if not row:
            row.append("0")
    head = draw(st.sampled_from(["", "", "names", "# made by hand", "60", "61", "words"]))
    if head == "names":
        head = separator.join(["x", "y", "z", "i", "j"][: 3 + extra])
    untouched &= head not in ("words", "61")
    lines = ([head] if head else []) + [separator.join(row) for row in rows]
    data = ending.join(lines).encode()
    given = draw(damage(data)) if draw(st.integers(0, 3)) == 0 else data
    return suffix, given, points if untouched and given == data else None


@cache
def bag_file(kind):
    """The bytes of a valid bag with a cloud, a depth image, its CameraInfo and an IMU."""
    from rosbags.rosbag1 import Writer

    from tests.scene import recorded_bags as bags
    from tests.scene.test_compressed_and_ros1 import ROS1, of_ros1

    messages = {
        "/points": bags.cloud(),
        "/depth/image": bags.image(),
        "/depth/camera_info": bags.info(),
        "/imu": bags.imu([0.0, 0.0, 9.8]),
    }
    folder = Path(tempfile.mkdtemp(prefix="fuzz_"))
    if kind == ".bag":
        with Writer(folder / "a.bag") as writer:
            for topic, message in messages.items():
                name = message.__msgtype__
                connection = writer.add_connection(topic, name, typestore=ROS1)
                writer.write(connection, 1, ROS1.serialize_ros1(of_ros1(message), name))
        return (folder / "a.bag").read_bytes()
    bags.write(folder / "bag", messages, {".mcap": "MCAP", ".db3": "SQLITE3"}[kind])
    (path,) = (folder / "bag").glob("*" + kind)
    return path.read_bytes()


@st.composite
def bag_files(draw):
    """Suffix and bytes of a bag, a topic, and whether the bytes are untouched."""
    suffix = draw(st.sampled_from([".mcap", ".db3", ".bag"]))
    good = bag_file(suffix)
    data = good
    for _ in range(draw(st.integers(0, 3))):
        data = draw(damage(data))
    topic = draw(st.sampled_from(["/points", "/depth/image", None, "/imu", "points"]))
    return suffix, data, topic, data == good


@st.composite
def bag_messages(draw):
    """Messages by topic whose sizes, offsets, types and numbers need not fit."""
    from tests.scene import recorded_bags as bags
    from tests.scene.test_compressed_and_ros1 import compressed, png, with_header

    cloud, image, info = bags.cloud(), bags.image(), bags.info()
    for message, names in (
        (cloud, ("height", "width", "point_step", "row_step")),
        (image, ("height", "width", "step")),
        (info, ("height", "width")),
    ):
        for name in draw(st.lists(st.sampled_from(names), max_size=2)):
            object.__setattr__(message, name, draw(EXTREME))
    if draw(st.booleans()):
        field = draw(st.sampled_from(cloud.fields))
        object.__setattr__(field, "offset", draw(EXTREME))
        object.__setattr__(field, "datatype", draw(st.integers(0, 255)))
        object.__setattr__(field, "name", draw(st.sampled_from(["x", "X", "", "z", "é"])))
    if draw(st.booleans()):
        object.__setattr__(image, "encoding", draw(st.sampled_from(["", "rgb8", "32FC1", "é"])))
    for matrix in draw(st.lists(st.sampled_from(["k", "p", "d"]), max_size=2)):
        values = getattr(info, matrix).copy()
        values[draw(st.integers(0, len(values) - 1))] = draw(
            st.sampled_from([0.0, np.nan, np.inf, -1.0, 1e300])
        )
        object.__setattr__(info, matrix, values)
    form = draw(st.sampled_from(["16UC1; compressedDepth png", "32FC1; compressedDepth", "jpeg"]))
    number = draw(st.sampled_from([0.0, 1.0, 1e4, np.nan, -np.inf]))
    packed = draw(damage(with_header(number, -number, png(bags.DEPTH))))
    imu = bags.imu([0.0, draw(st.sampled_from([0.0, np.nan, np.inf, 1e308])), 9.8])
    return {
        "/points": cloud,
        "/depth/image": image,
        "/depth/camera_info": info,
        "/depth/image/compressedDepth": compressed(form, packed),
        "/imu": imu,
    }, draw(st.sampled_from(["/points", "/depth/image", "/depth/image/compressedDepth"]))
