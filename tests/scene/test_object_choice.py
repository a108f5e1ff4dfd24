"""One object of a scene is chosen; a scan of one clean object is left as it is."""

import numpy as np
import pytest
import trimesh

from drake_aerial import InputError, PointCloud, partial_view, read_depth_image, read_scan
from drake_aerial.cloud.assumptions import AssumptionKind
from drake_aerial.io.model_files import models_dir, names
from drake_aerial.scene.find_scene import find_scene
from drake_aerial.scene.object_choice import (
    ObjectChoice,
    ObjectsNotChosenError,
    chosen_object,
    object_cloud,
)
from tests.scene import parcels


@pytest.fixture(scope="module")
def scene():
    millimetres = np.round(1000.0 * parcels.depths([parcels.LARGE, parcels.SMALL]))
    return find_scene(read_depth_image(millimetres.astype(np.uint16), parcels.CAMERA))


@pytest.mark.parametrize(
    ("parcel", "number"), [(parcels.LARGE, 2), (parcels.SMALL, 3)], ids=["large", "small"]
)
def test_number_pixel_and_point_choose_the_same_object(scene, parcel, number):
    p_C = parcels.top_middle_C(parcel)
    u, v = parcels.pixel_of(p_C)
    for choice in (
        ObjectChoice(number),
        ObjectChoice(pixel=(u, v)),
        ObjectChoice(point=tuple(p_C)),
    ):
        assert choice.of(scene).number == number


def test_without_a_choice_several_objects_are_an_error_that_holds_the_scene(scene):
    with pytest.raises(ObjectsNotChosenError, match="2 objects") as caught:
        ObjectChoice().of(scene)
    assert caught.value.scene is scene


def test_two_ways_at_once_are_refused():
    with pytest.raises(InputError, match="one way only, got object, pixel"):
        ObjectChoice(2, pixel=(1.0, 1.0))


def test_an_object_has_no_point_of_the_support_and_says_what_it_is(scene):
    cloud = object_cloud(scene, 3)
    height = cloud.points @ parcels.UP_C
    ground = scene.supports[0].offset
    assert (height - ground).min() > 0.0
    assert cloud.scene_object["number"] == 3
    assert cloud.scene_object["scene_up"] is None
    kinds = [assumption.kind for assumption in cloud.assumptions]
    assert AssumptionKind.SCENE in kinds
    # Gravity was unknown and is known now, to the stated uncertainty.
    assert "unknown" not in " ".join(assumption.text for assumption in cloud.assumptions)
    cloud.require_up()
    np.testing.assert_allclose(cloud.up, parcels.UP_C, atol=0.01)


@pytest.mark.parametrize("name", names("payloads"))
def test_shipped_scans_are_one_object_and_left_as_they_are(name):
    cloud = read_scan(name)
    assert chosen_object(cloud) is cloud


@pytest.mark.parametrize("mesh", ["bunny", "teapot", "ridged_parcel", "hollow_triangle"])
def test_one_sided_views_of_shipped_meshes_are_left_as_they_are(mesh):
    file = models_dir() / "meshes" / f"{mesh}.obj"
    for bearing in (0.0, 2.0):
        viewpoint = [1.1 * np.cos(bearing), 1.1 * np.sin(bearing), 1.0]
        cloud = partial_view(file, viewpoint, resolution=(160, 120))
        assert chosen_object(cloud) is cloud


def test_a_box_on_a_large_table_is_found_in_world_axes():
    table = trimesh.creation.box([1.6, 1.0, 0.02])
    table.apply_translation([0.0, 0.0, -0.01])
    parcel = trimesh.creation.box([0.3, 0.2, 0.15])
    parcel.apply_translation([0.2, 0.1, 0.075])
    viewpoint, rng = [0.0, -1.1, 0.9], np.random.default_rng(0)
    both = trimesh.util.concatenate([table, parcel])
    view = partial_view(both, viewpoint, noise=0.002, rng=rng)
    cloud = chosen_object(PointCloud.read(view.points, viewpoint=viewpoint))
    np.testing.assert_allclose(cloud.points.max(axis=0), [0.35, 0.2, 0.15], atol=0.01)
    assert cloud.points[:, 2].min() > -0.005
    assert chosen_object(view, ObjectChoice(whole=True)) is view


def test_a_bare_table_in_world_axes_is_refused_unless_it_is_meant():
    table = trimesh.creation.box([1.6, 1.0, 0.02])
    view = partial_view(table, [0.0, 0.0, 2.0], resolution=(160, 120))
    with pytest.raises(InputError, match=r"one plane of 1\.6 m\^2 with nothing on it"):
        chosen_object(view)
    assert chosen_object(view, ObjectChoice(whole=True)) is view
