"""Each kind of page in a real browser, on a wide and on a narrow screen."""

import io
from functools import partial

import numpy as np
import pytest
import trimesh
from PIL import Image

from drake_aerial import read_scan, read_skill, transfer
from drake_aerial.demo import run_demo
from drake_aerial.references.trajectory import HoverTrajectory
from drake_aerial.simulation import trial
from drake_aerial.simulation.trial_result import TrialResult
from drake_aerial.visualization.file_view import write_view

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A page of each kind, about one small box; flights are short, the demo's too."""
    folder = tmp_path_factory.mktemp("pages")
    trimesh.creation.box((0.45, 0.35, 0.25)).export(folder / "cloud.ply")
    skill = read_skill("flat")
    skill.save(folder / "skill.npz")
    transfer(skill, read_scan(folder / "cloud.ply"), top=3).write(folder / "contacts.json")
    for kind, name in (
        ("cloud", "cloud.ply"),
        ("skill", "skill.npz"),
        ("contacts", "contacts.json"),
    ):
        write_view(
            folder / name, folder / f"{kind}.html", skill=skill if kind == "contacts" else None
        )
    short = partial(
        trial.fly,
        trajectory=HoverTrajectory(ground_time=1.0, lift_time=1.0, hover_time=1.0),
        force=True,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trial, "fly", short)
        run_demo(folder / "demo")
    write_view(folder / "demo", folder / "trial.html")
    return folder


def seen(page, selector):
    """Return the pixels (H, W, 3) of an element as it is on the screen."""
    shot = page.screenshot(clip=page.locator(selector).bounding_box())
    with Image.open(io.BytesIO(shot)) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def colored(pixels):
    """Return the part of the pixels that are neither white nor grey."""
    return float((np.ptp(pixels, axis=-1) > 60).mean())


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("cloud", ["convex", "20,000 points", "0.450 x 0.350 x 0.250 m"]),
        ("skill", ["task features", "contact features"]),
        (
            "contacts",
            ["method task, skill flat, seed 0", "log J", "feasible", "scan: contact likely"],
        ),
        ("trial", ["reference path", "position RMSE", "slack cable"]),
    ],
)
def test_a_page_shows_its_picture_and_its_card(opened, folder, kind, words):
    page = opened(folder / f"{kind}.html")
    # A film is costly where no graphics card helps.
    page.evaluate("viewer.animator.pause()")
    if page.viewport_size["width"] < 600:
        # Folded, so that the picture is seen first.
        assert not page.get_by_text(words[0]).first.is_visible()
        page.locator("#card summary").click()
    for word in words:
        assert page.get_by_text(word).first.is_visible(), word
    page.locator("#card summary").click()
    page.wait_for_function("viewer.renderer.info.render.triangles > 1000")
    page.wait_for_timeout(300)
    pixels = seen(page, "#meshcat-pane")
    assert pixels.std() > 5
    # What is drawn stands in the middle and is not cut off at the sides.
    height, width = pixels.shape[:2]
    assert colored(pixels[height // 4 : -height // 4, width // 4 : -width // 4]) > 0.002
    if kind != "trial":
        assert colored(pixels[60:, [0, 1, -2, -1]]) == 0.0
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_the_plots_go_with_the_flight_and_take_it_along(opened, folder):
    page = opened(folder / "trial.html")
    page.wait_for_function("viewer.animator.time > 0.2")
    span = page.evaluate("replay.span")
    at = "Number(document.querySelector('#plots .cursor').getAttribute('x1')) / 1000 * replay.span"
    assert 0.0 < page.evaluate(at) < span
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Play").wait_for()
    box = page.locator("#plots svg").nth(1).bounding_box()
    assert box["height"] > 30
    assert box["width"] > 250
    page.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + 20)
    page.wait_for_function(f"Math.abs(viewer.animator.time - {0.75 * span}) < 0.02 * {span}")
    page.wait_for_function(f"Math.abs({at} - {0.75 * span}) < 0.02 * {span}")
    # By now the payload has been lifted; at the start it stood on the ground.
    height = "viewer.scene_tree.find(['drake', 'payload']).object.position.z"
    up = page.evaluate(height)
    page.evaluate("replay.seek(0)")
    down = page.evaluate(height)
    flown = TrialResult.load(folder / "demo").series
    flown_up = np.interp(0.75 * span, flown["time"], flown["payload_position"][:, 2])
    assert up == pytest.approx(flown_up, abs=0.03)
    assert up - down > 0.5
    assert down == pytest.approx(flown["payload_position"][0, 2], abs=1e-4)
    # Its cable is slack there, and taut later.
    shown = (
        "['taut0', 'slack0'].map(name => viewer.scene_tree.find(['drake', name]).object.visible)"
    )
    assert page.evaluate(shown) == [False, True]
    page.evaluate(f"replay.seek({0.75 * span})")
    assert page.evaluate(shown) == [True, False]
    page.get_by_role("button", name="Play").click()
    page.wait_for_function(f"viewer.animator.time < {0.5 * span}")  # it starts again at its end


def test_the_demos_report_reads_on_any_screen(opened, folder):
    page = opened(folder / "demo" / "report.html")
    assert page.locator("h1").inner_text() == "One demonstration, a new payload, a flight"
    assert "cm" in page.locator(".answer").inner_text()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    images = page.locator("figure img")
    assert images.count() == 2
    for index in range(2):
        assert images.nth(index).evaluate("image => image.complete && image.naturalWidth > 500")
    page.locator("iframe").scroll_into_view_if_needed()
    replay = page.frame_locator("iframe")
    replay.locator("#plots button").wait_for()
    pixels = seen(page, "iframe")
    assert pixels.std() > 5
