"""The page of a scene: image, cloud in space, list, and the choice of an object by a click."""

import json
import re

import numpy as np
import pytest

from drake_aerial import read_depth_image
from drake_aerial.cloud.boundary import BoundaryKind
from drake_aerial.scene.find_scene import find_scene
from drake_aerial.visualization.scene_page import (
    BOUNDARY_COLORS,
    object_color,
    scene_picture,
    write_scene_page,
)
from tests.scene import parcels


@pytest.fixture(scope="module")
def scene():
    millimetres = np.round(1000.0 * parcels.depths([parcels.LARGE, parcels.SMALL]))
    return find_scene(read_depth_image(millimetres.astype(np.uint16), parcels.CAMERA))


@pytest.fixture(scope="module")
def page_file(scene, tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "scene.html"
    write_scene_page(file, scene)
    return file


def test_the_picture_shows_objects_in_their_colours_and_outlines_by_kind(scene):
    picture = scene_picture(scene)
    assert picture.shape == (480, 640, 3)
    for number, parcel in ((2, parcels.LARGE), (3, parcels.SMALL)):
        u, v = np.round(parcels.pixel_of(parcels.top_middle_C(parcel))).astype(int)
        mixed = picture[v, u] / 255.0
        # Grey of the depth under the object's colour.
        grey = (mixed - 0.65 * np.array(object_color(number))) / 0.35
        assert np.ptp(grey) < 0.05
    seen = np.round(255.0 * np.array(BOUNDARY_COLORS[BoundaryKind.SEEN]))
    assert (picture == seen).all(axis=-1).sum() > 200


def test_the_page_needs_no_other_file_and_holds_the_objects(page_file):
    page = page_file.read_text()
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page).group(1))
    assert data["numbers"] == [2, 3]
    assert data["chosen"] == 0
    assert "--object {N}" in data["command"]


@pytest.mark.browser
def test_an_object_is_chosen_by_a_click_on_image_cloud_or_list(opened, page_file):
    page = opened(page_file)
    page.wait_for_timeout(500)
    choice = page.locator("#choice")
    assert choice.inner_text() == "No object is chosen."
    box = page.locator("#image").bounding_box()
    u, v = parcels.pixel_of(parcels.top_middle_C(parcels.LARGE))
    page.mouse.click(box["x"] + u / 640 * box["width"], box["y"] + v / 480 * box["height"])
    assert "--object 2" in choice.inner_text()
    page.locator("tbody tr").nth(1).click()
    assert "--object 3" in choice.inner_text()
    # The middle of the view in space is the middle of the objects' points: on the large one.
    space, hits = page.locator("#space"), set()
    box = space.bounding_box()
    for share in (0.35, 0.4, 0.45, 0.5):
        space.click(position={"x": share * box["width"], "y": 0.5 * box["height"]})
        hits.add(choice.inner_text()[:8])
    assert "Object 2" in hits
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
