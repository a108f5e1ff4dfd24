import numpy as np
import pytest
from pydrake.perception import BaseField, Fields
from pydrake.perception import PointCloud as DrakeCloud

from drake_aerial.cloud.objects import from_object
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.errors import InputError

P = np.random.default_rng(0).random((60, 3)).astype(np.float32)


def structured(names, shape=(60,)):
    array = np.zeros(shape, [(name, "<f4") for name in names])
    for k, name in enumerate([n for n in names if n[-1] in "xyzXYZ012" and n[0] != "n"][:3]):
        array[name] = P[:, k].reshape(shape)
    return array


def drake_cloud():
    cloud = DrakeCloud(60, Fields(BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = P.T
    return cloud


class DataFrame:
    """As pandas has it."""

    def to_records(self, index=True):
        assert not index
        return structured(["t", "x", "y", "z"]).view(np.recarray)


class Tensor:
    """As libraries of tensors have it."""

    def __array__(self, dtype=None, copy=None):
        return P if dtype is None else P.astype(dtype)


OBJECTS = {
    "fields of librealsense": structured(["f0", "f1", "f2"]),
    "fields of ROS": structured(["x", "y", "z", "rgb"]),
    "fields in capitals": structured(["X", "Y", "Z"]),
    "fields after normals": structured(["nx", "ny", "nz", "px", "py", "pz"]),
    "fields, organised": structured(["x", "y", "z"], (6, 10)),
    "organised": P.reshape(6, 10, 3),
    "organised, four columns": np.concatenate([P, P[:, :1]], 1).reshape(6, 10, 4),
    "a masked array": np.ma.MaskedArray(P, mask=False),
    "a matrix": np.asmatrix(P),
    "Drake's cloud": drake_cloud(),
    "a data frame": DataFrame(),
    "a tensor": Tensor(),
} | {f"{n} columns": np.concatenate([P, P], 1)[:, :n] for n in (4, 5, 6)}


@pytest.mark.parametrize("name", OBJECTS)
def test_points(name):
    geometry = from_object(OBJECTS[name])
    np.testing.assert_array_equal(geometry.points, P)
    kinds = [str(assumption.kind) for assumption in geometry.assumptions]
    assert kinds == (["axes"] if "columns" in name else [])


def test_masked_points_are_dropped():
    mask = np.zeros(P.shape, bool)
    mask[:3, 2] = True
    assert PointCloud.read(np.ma.MaskedArray(P, mask)).dropped_points == 3


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            structured(["u", "v", "depth"]),
            "must have fields x, y, z or f0, f1, f2, got u, v, depth",
        ),
        (P.T, r"got \(3, 60\); transpose it by .T"),
        (np.zeros((60, 9)), r"got \(60, 9\); take the columns of x, y, z, such as \[:, :3\]"),
        (np.zeros((48, 64)), r"got \(48, 64\); a depth image needs its camera"),
        (np.zeros(9), r"got \(9,\)"),
        (np.zeros((2, 2, 2, 3)), r"got \(2, 2, 2, 3\)"),
        (DrakeCloud(5, Fields(BaseField.kNormals)), "the pydrake PointCloud has no xyzs"),
        (DrakeCloud(0), "the pydrake PointCloud holds no points"),
    ],
)
def test_impossible_objects_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        from_object(given)
