"""The server of the demonstration page: its answers, and who gets them."""

import json
import urllib.error
import urllib.request

import numpy as np
import pytest
import trimesh

from drake_aerial.annotation.demonstration_draft import DemonstrationDraft
from drake_aerial.annotation.demonstration_server import DemonstrationServer
from drake_aerial.cloud.point_cloud import PointCloud
from drake_aerial.skill.demonstration import Demonstration


@pytest.fixture
def server(tmp_path):
    points = trimesh.sample.sample_surface(trimesh.creation.box((0.6, 0.4, 0.3)), 8000, seed=3)[0]
    with DemonstrationServer(
        DemonstrationDraft(PointCloud.read(points)), tmp_path / "shown.yaml"
    ) as server:
        yield server


def ask(url: str, body: bytes | None = None):
    with urllib.request.urlopen(urllib.request.Request(url, data=body), timeout=10) as answer:
        return answer.read()


def test_it_gives_the_page_and_the_points(server):
    assert b"Where do the grippers belong?" in ask(server.url)
    scene = json.loads(ask(server.url + "scene.json"))
    assert scene["points"] == 8000
    points = np.frombuffer(ask(server.url + "points"), "<f4").reshape(-1, 6)
    assert np.abs(points[:, :3]).max(0) == pytest.approx([0.3, 0.2, 0.15], abs=1e-3)
    assert np.linalg.norm(points[:, 3:], axis=1) == pytest.approx(1.0, abs=1e-5)


def test_it_saves_a_demonstration(server):
    touch = json.loads(
        ask(server.url + "touch", json.dumps({"position": [0.1, 0.0, 0.15]}).encode())
    )
    assert touch["normal"] == pytest.approx([0, 0, 1], abs=1e-6)
    gripper = {"position": touch["position"], "cable_length": 0.7, "cable_direction": [0, 0.6, 0.8]}
    ask(server.url + "save", json.dumps({"grippers": [gripper], "name": "lean"}).encode())
    assert server.saved.is_set()
    shown = Demonstration.read(server.out)
    assert shown.name == "lean"
    assert shown.quadrotors.p[0] - shown.grippers.p[0] == pytest.approx([0, 0.42, 0.56], abs=1e-5)


@pytest.mark.parametrize(
    ("action", "body"),
    [
        ("touch", b'{"position": [0, 0, 9]}'),
        ("touch", b'{"position": "here"}'),
        ("touch", b"{}"),
        ("touch", b"[1"),
        ("save", b'{"grippers": []}'),
        ("save", b'{"grippers": [{"position": [0, 0, 0.15]}]}'),
        *(
            (
                "save",
                b'{"grippers": [{"position": [0, 0, 0.15], "cable_direction": [0, 0, 1],'
                b' "cable_length": %s}]}' % length,
            )
            for length in (b'"x"', b"0")
        ),
    ],
)
def test_bad_requests_are_answered_and_write_nothing(server, action, body):
    with pytest.raises(urllib.error.HTTPError) as refused:
        ask(server.url + action, body)
    assert refused.value.code == 400
    assert json.loads(refused.value.read())["error"]
    assert not server.out.exists()


def test_another_page_of_this_machine_gets_nothing(server):
    root = server.url.rsplit("/", 2)[0]
    for url in (root + "/", root + "/scene.json", root + "/guess/scene.json"):
        with pytest.raises(urllib.error.HTTPError) as refused:
            ask(url)
        assert refused.value.code == 404
