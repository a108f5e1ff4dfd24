"""Inputs as strangers, broken disks and ill will make them."""

import io
import json
import pickle
import struct
import zipfile

import numpy as np
import trimesh
from hypothesis import strategies as st

SHAPES = ("box", "ball", "plane", "line", "point", "few", "none", "noise")
UNITS = (1.0, 1e3, 1e-3, 1e6, 1e-9, 1e30, 0.0)
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(allow_nan=True, allow_infinity=True),
    st.text(max_size=20),
    st.sampled_from(
        [
            "",
            "\n",
            "../../etc/passwd",
            "package://drake_aerial/../../../etc/passwd",
            "5e3",
            ".inf",
            "a\nb",
            "x" * 5000,
            "°",
            "\x00",
        ]
    ),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=8,
)


@st.composite
def points(draw):
    """Clouds (N, 3) of at most 700 points, of many shapes and units, valid and broken."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape, count = draw(st.sampled_from(SHAPES)), draw(st.integers(1, 700))
    if shape == "box":
        p = trimesh.sample.sample_surface(trimesh.creation.box((0.4, 0.3, 0.2)), count, seed=0)[0]
    elif shape == "ball":
        p = rng.standard_normal((count, 3))
        p *= 0.2 / np.linalg.norm(p, axis=1, keepdims=True)
    elif shape == "plane":
        p = rng.uniform(-0.3, 0.3, (count, 3)) * [1, 1, 0]
    elif shape == "line":
        p = np.linspace(0, 0.4, count)[:, None] * [1.0, 0.5, 0.2]
    elif shape == "point":
        p = np.full((count, 3), 0.1)
    elif shape == "few":
        p = rng.uniform(size=(draw(st.integers(1, 4)), 3))
    elif shape == "none":
        p = np.zeros((0, 3))
    else:
        p = rng.uniform(-0.3, 0.3, (count, 3))
    p = np.array(p, float) * draw(st.sampled_from(UNITS)) + draw(
        st.sampled_from([0.0, 0.0, 1e3, 1e12])
    )
    if len(p) and draw(st.booleans()):
        bad = rng.random(len(p)) < draw(st.sampled_from([0.01, 0.5, 1.0]))
        p[bad] = draw(st.sampled_from([np.nan, np.inf, -np.inf, 1e308, 0.0]))
    if len(p) and draw(st.integers(0, 9)) == 0:
        p = np.repeat(p, 2, axis=0)
    return p


def ply(p, *, binary, faces=()):
    kind = "binary_little_endian" if binary else "ascii"
    head = f"ply\nformat {kind} 1.0\nelement vertex {len(p)}\n" + "".join(
        f"property float {a}\n" for a in "xyz"
    )
    if len(faces):
        head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    head += "end_header\n"
    if binary:
        with np.errstate(all="ignore"):
            body = p.astype("<f4").tobytes()
        return head.encode() + body + b"".join(struct.pack("<Biii", 3, *map(int, f)) for f in faces)
    rows = [" ".join(map(repr, map(float, row))) for row in p] + [
        "3 " + " ".join(map(str, f)) for f in faces
    ]
    return (head + "\n".join(rows) + "\n").encode()


def pcd(p, *, binary):
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(p)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(p)}\n"
        f"DATA {'binary' if binary else 'ascii'}\n"
    )
    with np.errstate(all="ignore"):
        body = (
            p.astype("<f4").tobytes()
            if binary
            else "\n".join(" ".join(map(str, row)) for row in p).encode()
        )
    return head.encode() + body


def obj(p, faces):
    rows = ["mtllib ../../../etc/passwd"] + [f"v {x} {y} {z}" for x, y, z in p]
    return (
        "\n".join(rows + ["f " + " ".join(str(i + 1) for i in f) for f in faces]) + "\n"
    ).encode()


def stl(p, faces):
    body = b"".join(
        struct.pack("<12fH", 0, 0, 1, *np.clip(p[list(f)], -1e30, 1e30).ravel(), 0) for f in faces
    )
    return b"\0" * 80 + struct.pack("<I", len(faces)) + body


def npy(array):
    file = io.BytesIO()
    np.save(file, array, allow_pickle=array.dtype.hasobject)
    return file.getvalue()


def npz(**arrays):
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def header_of(shape, descr="<f8"):
    """An .npy file whose header promises an array that is not there."""
    text = repr({"descr": descr, "fortran_order": False, "shape": shape}).encode()
    text += b" " * (63 - (10 + len(text)) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def bomb(name="points.npy", gigabytes=3):
    """An archive of a few megabytes at most that unpacks to many more."""
    file = io.BytesIO()
    with (
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open(name, "w") as member,
    ):
        block = header_of((gigabytes * 2**27 // 3, 3)) + bytes(2**20)
        member.write(block)
    data = bytearray(file.getvalue())
    # The sizes in the directory at the end are what readers trust before they unpack.
    at = data.rfind(b"PK\x01\x02")
    struct.pack_into("<I", data, at + 24, min(gigabytes * 2**30, 2**32 - 2))
    return bytes(data)


class Opened:
    """What must never be called when a file is read."""

    def __reduce__(self):
        return (exec, ("raise SystemExit('a pickle was loaded')",))


@st.composite
def damage(draw, data):
    """The bytes, or what remains of them."""
    how = draw(st.sampled_from(["", "", "cut", "flip", "insert", "repeat", "zero", "text"]))
    if not how or not data:
        return data
    at = draw(st.integers(0, len(data) - 1))
    if how == "cut":
        return data[:at]
    if how == "flip":
        changed = bytearray(data)
        for _ in range(draw(st.integers(1, 8))):
            changed[draw(st.integers(0, len(data) - 1))] = draw(st.integers(0, 255))
        return bytes(changed)
    if how == "insert":
        return data[:at] + draw(st.binary(max_size=40)) + data[at:]
    if how == "repeat":
        return data[:at] + data[max(0, at - 50) : at] * draw(st.integers(1, 20)) + data[at:]
    if how == "zero":
        return data[:at] + bytes(len(data) - at)
    # Numbers in headers are what readers believe.
    old = draw(
        st.sampled_from([b"0", b"1", b"vertex", b"float", b"3 ", b"POINTS", b"<f8", b"schema"])
    )
    new = draw(
        st.sampled_from([b"99999999999", b"-1", b"nan", b"", b"double", b"\xff\xfe", b"1e400"])
    )
    return data.replace(old, new, draw(st.integers(1, 3)))


@st.composite
def depth_images(draw):
    """A depth image (H, W) and a mapping of intrinsics, both of them now and then impossible."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    height, width = draw(st.sampled_from([(48, 64), (1, 1), (0, 5), (30, 40)]))
    depth = rng.uniform(0.5, 2.0, (height, width)) * draw(st.sampled_from([1, 1000, 1e9, 0, -1]))
    depth[rng.random(depth.shape) < draw(st.sampled_from([0.0, 0.3, 1.0]))] = draw(
        st.sampled_from([0.0, np.nan, np.inf])
    )
    kind = draw(st.sampled_from(["f4", "f8", "u2", "u1", "i8", "c16", "O", "U5", "?"]))
    with np.errstate(all="ignore"):
        depth = (
            np.nan_to_num(depth, posinf=0).astype(kind) if kind[0] in "ui" else depth.astype(kind)
        )
    camera = {"width": width, "height": height, "fx": 60, "fy": 60, "cx": width / 2 - 0.5}
    camera |= {"cy": height / 2 - 0.5, "distortion": draw(st.sampled_from([[], [0.1, 0, 0, 0]]))}
    for key in draw(st.lists(st.sampled_from([*camera, "depth_scale", "distortion_model"]))):
        camera[key] = draw(st.one_of(VALUES, st.sampled_from([[1e9] * 5, [-5.0, 3, 1, 1], 1000])))
    if draw(st.integers(0, 3)) == 0:
        camera = {"k": draw(st.one_of(VALUES, st.just([60, 0, 31, 0, 60, 23, 0, 0, 1]))), **camera}
        camera.pop("fx"), camera.pop("fy")
    return depth, camera


@st.composite
def cloud_files(draw):
    """A suffix and the content of a file that claims to be a cloud or mesh."""
    special = draw(st.integers(0, 24))
    if special == 0:
        return ".npy", npy(np.array([[Opened()]], dtype=object))
    if special == 1:
        return ".npz", npz(points=np.array([Opened(), 1, 2], dtype=object))
    if special == 2:
        return ".npy", pickle.dumps(Opened())
    if special == 3:
        return draw(st.sampled_from([".npy", ".npz"])), header_of(
            (draw(st.sampled_from([10**4, 10**9, 10**15, -5])), 3)
        )
    if special == 4:
        return ".npz", bomb()
    if special == 5:
        return draw(
            st.sampled_from([".ply", ".pcd", ".obj", ".stl", ".npy", ".npz", ".xyz", ""])
        ), draw(st.binary(max_size=300))
    p = draw(points())
    faces = [(i, i + 1, i + 2) for i in range(0, len(p) - 2, draw(st.integers(1, 3)))][:200]
    kind = draw(
        st.sampled_from(
            ["ply", "plyb", "pcd", "pcdb", "obj", "stl", "npy", "npz", "npyi", "mesh", "text"]
        )
    )
    if kind in ("ply", "plyb", "mesh"):
        suffix, data = ".ply", ply(p, binary=kind == "plyb", faces=faces if kind == "mesh" else ())
    elif kind in ("pcd", "pcdb"):
        suffix, data = ".pcd", pcd(p, binary=kind == "pcdb")
    elif kind == "obj":
        suffix, data = ".obj", obj(p, faces)
    elif kind == "stl":
        suffix, data = ".stl", stl(p, faces)
    elif kind == "text":
        separator = draw(st.sampled_from([" ", ",", ";", "\t"]))
        head = draw(st.sampled_from(["", "x,y,z\n", "# x\n", f"{len(p)}\n", "z;y;x\n", "10000\n"]))
        rows = [separator.join(map(repr, map(float, row))) for row in p]
        suffix = draw(st.sampled_from([".xyz", ".csv", ".txt", ".pts", ".asc"]))
        data = (head + "\n".join(rows)).encode()
    elif kind == "npz":
        names = draw(
            st.sampled_from(
                [{"points": p}, {"points": p, "viewpoint": np.array([0.0, 0, 3])}, {"xyz": p}, {}]
            )
        )
        suffix, data = ".npz", npz(**names)
    elif kind == "npyi":
        with np.errstate(all="ignore"):
            other = draw(
                st.sampled_from(
                    [
                        p.astype("f2"),
                        p.T,
                        p[:, :2],
                        p[None],
                        p.astype(str),
                        p.astype(complex),
                        p.ravel(),
                    ]
                )
            )
        suffix, data = ".npy", npy(other)
    else:
        suffix, data = ".npy", npy(p)
    return suffix, draw(damage(data))


@st.composite
def documents(draw, good):
    """The mapping `good`, changed in a few places anywhere in it."""
    document = json.loads(json.dumps(good))
    for _ in range(draw(st.integers(1, 3))):
        place, path = document, []
        while True:
            keys = list(place) if isinstance(place, dict) else list(range(len(place)))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            path.append((place, key))
            if not isinstance(place[key], (dict, list)) or draw(st.integers(0, 2)) == 0:
                break
            place = place[key]
        if not path:
            continue
        place, key = path[-1]
        how = draw(st.sampled_from(["value", "value", "delete", "add"]))
        if how == "value":
            place[key] = draw(VALUES)
        elif how == "delete":
            del place[key]
        elif isinstance(place, dict):
            place[draw(st.text(max_size=10))] = draw(VALUES)
        else:
            place.append(draw(VALUES))
    return document


def laughs(depth=12):
    """A short YAML file that stands for ten to the power of `depth` values."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, depth)]
    return "\n".join(lines) + "\n"


HOSTILE_YAML = (
    laughs(),
    "box: " + laughs(3).replace("\n", "\nq") + "\n",
    "a: &a [*a]\n",
    "&a {mass: *a}\n",
    "!!python/object/apply:os.system [echo pwned]\n",
    "!!python/name:os.system\n",
    "mass: !!binary aGVsbG8=\nbox: !!set {1, 2}\n",
    "[" * 3000,
    "{a: " * 3000,
    "mass: 1\nmass: 2\nbox: [1, 1, 1]\n",
    "mass: 0x" + "f" * 9000 + "\n",
    "mass: " + "9" * 9000 + "\nbox: [1, 1, 1]\n",
    "? [complex, key]\n: 1\n",
    "? {a: 1}\n: 1\n",
    "mass: 2001-01-01\nbox: 12:30:45\n",
    "\t- tab\n",
    "\x00\x01",
    "﻿mass: 1\n",
    "--- 1\n--- 2\n",
    "%YAML 9.9\n---\nmass: 1\n",
    "<<: [1]\nmass: 1\n",
    "null\n",
    "",
)
