"""The page of a demonstration in a real browser."""

import numpy as np
import pytest
import trimesh

from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
from drake_aerial.annotation.demonstration_server import DemonstrationServer
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.skill.demonstration import Demonstration

pytestmark = pytest.mark.browser


@pytest.fixture
def server(tmp_path):
    points = trimesh.sample.sample_surface(trimesh.creation.box((0.6, 0.4, 0.3)), 20000, seed=3)[0]
    with DemonstrationServer(
        DemonstrationDraft(PointCloud.read(points)), tmp_path / "shown.yaml"
    ) as server:
        yield server


@pytest.fixture(params=[(1200, 800), (390, 780)], ids=["desktop", "phone"])
def page(request, browser, server):
    page = browser.new_page(viewport={"width": request.param[0], "height": request.param[1]})
    complaints = []
    page.on(
        "console",
        lambda message: (
            complaints.append(message.text) if message.type in ("error", "warning") else None
        ),
    )
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(server.url)
    page.wait_for_function("window.demonstration && window.demonstration.ready")
    yield page
    # The software renderer's remarks on its own speed are not ours.
    assert [c for c in complaints if "GPU stall" not in c and "swiftshader" not in c.lower()] == []
    page.close()


def on_screen(page, place):
    return page.evaluate("p => window.demonstration.project(p)", list(place))[:2]


def click(page, place):
    before = page.locator("#list li").count()
    page.mouse.click(*on_screen(page, place))
    page.wait_for_function("n => document.querySelectorAll('#list li').length > n", arg=before)


def test_clicks_become_a_demonstration(page, server):
    click(page, [0.2, 0.1, 0.15])
    click(page, [-0.2, -0.1, 0.15])
    click(page, [-0.1, 0.1, 0.15])
    assert page.locator("#list li").nth(0).inner_text().count("flat") == 1
    page.locator("#list li").nth(2).get_by_role("button", name="remove").click()

    start = on_screen(page, page.evaluate("window.demonstration.quadrotor(0)"))
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(start[0] + 25, start[1] + 5, steps=5)
    page.mouse.up()
    there = on_screen(page, page.evaluate("window.demonstration.quadrotor(0)"))
    assert there == pytest.approx([start[0] + 25, start[1] + 5], abs=3)

    page.get_by_label("Name").fill("clicked")
    page.get_by_role("button", name="Save 2 contacts").click()
    page.wait_for_selector("#message.good")
    assert server.saved.wait(1.0)
    shown = Demonstration.read(server.out)
    assert shown.name == "clicked"
    assert shown.grippers.p == pytest.approx(
        np.array([[0.2, 0.1, 0.15], [-0.2, -0.1, 0.15]]), abs=0.004
    )
    lean = shown.quadrotors.p - shown.grippers.p
    assert np.linalg.norm(lean, axis=1) == pytest.approx([0.5, 0.5], abs=1e-5)
    assert np.linalg.norm(lean[0, :2]) > 0.02
    assert lean[1] == pytest.approx([0, 0, 0.5], abs=1e-5)


def test_a_click_beside_the_cloud_says_so_and_dragging_turns_the_view(page, server):
    page.mouse.click(12, 12)
    page.wait_for_selector("#message.bad")
    assert page.locator("#list li").count() == 0
    place = [0.2, 0.1, 0.15]
    before = on_screen(page, place)
    page.mouse.move(100, 100)
    page.mouse.down()
    page.mouse.move(160, 110, steps=4)
    page.mouse.up()
    assert np.hypot(*(np.subtract(on_screen(page, place), before))) > 10
    assert page.locator("#list li").count() == 0
    click(page, place)
    assert not server.out.exists()
