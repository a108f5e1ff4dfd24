"""The command `scene`, and the choice of an object in `transfer` and `demonstrate`."""

import json

import numpy as np
import pytest
import yaml
from PIL import Image

from drake_aerial.cli import main
from drake_aerial.cloud.boundary import BoundaryKind
from drake_aerial.contacts.recomputation import recompute_query
from drake_aerial.contacts.scan_lookup import find_scan
from drake_aerial.contacts.solutions import ContactSolutions
from drake_aerial.named_inputs import read_skill
from tests.scene import parcels

FEW = {"candidates": 500, "starts": 40, "chains": 20, "steps": 60}


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return parcels.write(tmp_path_factory.mktemp("scene"), [parcels.LARGE, parcels.SMALL])


def run(*arguments):
    return main([str(argument) for argument in arguments])


@pytest.fixture
def transferred(tmp_path):
    """Return a function that transfers `flat` and returns the exit code and the contacts."""
    few = tmp_path / "few.yaml"
    few.write_text(yaml.safe_dump(FEW))

    def transfer(*arguments):
        out = tmp_path / "contacts.json"
        out.unlink(missing_ok=True)
        code = run("transfer", "flat", *arguments, "--parameters", few, "--top", 1, "--out", out)
        return code, ContactSolutions.read(out) if out.exists() else None

    return transfer


def test_scene_lists_gravity_and_objects_and_writes_their_numbers(scene, tmp_path, capsys):
    assert run("scene", *scene, "--json", "--labels", tmp_path / "labels.png") == 0
    found = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(found["gravity"]["up"], parcels.UP_C, atol=0.01)
    assert found["gravity"]["source"] == "support"
    assert [entry["number"] for entry in found["objects"]] == [2, 3]
    for entry, (_, size) in zip(found["objects"], (parcels.LARGE, parcels.SMALL), strict=True):
        np.testing.assert_allclose(entry["box"]["size"][2], size[2], atol=0.02)
        assert entry["outline"]["seen"] > 0.9

    labels = np.asarray(Image.open(tmp_path / "labels.png"))
    assert labels.shape == (480, 640)
    assert labels.dtype == np.uint8
    for number, parcel in ((2, parcels.LARGE), (3, parcels.SMALL)):
        u, v = np.round(parcels.pixel_of(parcels.top_middle_C(parcel))).astype(int)
        assert labels[v, u] == number
    assert labels[-1, 0] == 1


def test_several_objects_and_no_choice_are_a_list_and_exit_code_2(scene, transferred, capsys):
    code, contacts = transferred(*scene)
    printed = capsys.readouterr().err
    assert code == 2
    assert contacts is None
    assert "object 2: " in printed
    assert "object 3: " in printed
    assert printed.splitlines()[-1].endswith("(`drake-aerial scene` shows them)")


def test_an_object_of_a_scene_is_printed_recorded_and_found_again(scene, transferred, capsys):
    p_C = parcels.top_middle_C(parcels.SMALL)
    code, contacts = transferred(*scene, "--pixel", *parcels.pixel_of(p_C))
    printed = capsys.readouterr().err
    assert code == 0
    # In the camera's own axes, and on the parcel, not on the floor.
    assert np.linalg.norm(contacts[0].X_SG.p[0] - p_C) < 0.03
    assert contacts.cloud["object"]["number"] == 3
    assert contacts.cloud["object"]["gravity"]["source"] == "support"
    assert {"scene", "up"} <= {entry["kind"] for entry in contacts.cloud["assumptions"]}
    for entry in contacts.cloud["assumptions"]:
        assert f"assumed {entry['kind']}: {entry['text']}" in printed
    cloud = find_scan(contacts.cloud, None)
    assert len(cloud) == contacts.cloud["points"]
    np.testing.assert_array_equal(cloud.up, contacts.cloud["up"])
    assert cloud.boundary.share(BoundaryKind.SEEN) > 0.9
    assert recompute_query(contacts, read_skill("flat"), cloud) is not None


def test_an_object_alone_is_the_payload_as_before(tmp_path, transferred):
    scan = [*parcels.write(tmp_path, [parcels.LARGE], floor=False), "--up", *parcels.UP_C]
    found = [transferred(*scan, *way) for way in ([], ["--whole"])]
    assert "object" not in found[0][1].cloud
    assert found[0][1].to_dict()["solutions"] == found[1][1].to_dict()["solutions"]


def test_a_floor_alone_is_refused_in_one_line(tmp_path, transferred, capsys):
    code, contacts = transferred(*parcels.write(tmp_path, []))
    assert code == 2
    assert contacts is None
    assert "only a plane" in capsys.readouterr().err.splitlines()[-1]


def test_an_up_that_contradicts_the_support_is_reported_and_recorded(scene, transferred, capsys):
    tilt = np.deg2rad(6.0)
    wrong = parcels.UP_C * np.cos(tilt) + np.array([1.0, 0.0, 0.0]) * np.sin(tilt)
    assert run("scene", *scene, "--up", *wrong, "--json") == 0
    assert "differ by 6." in json.loads(capsys.readouterr().out)["gravity"]["warning"]


def test_a_demonstration_on_an_object_of_a_scene_is_read_again(scene, tmp_path, capsys):
    p_C = parcels.top_middle_C(parcels.SMALL)
    out = tmp_path / "demonstration.yaml"
    assert run("demonstrate", *scene, "--at", *p_C, "--out", out) == 0
    written = yaml.safe_load(out.read_text())
    assert written["cloud"]["object"] == 3
    assert "up" not in written["cloud"]
    skill = read_skill(out)
    # The object alone was learnt from: its outline is that of the small parcel.
    assert skill.hull.area == pytest.approx(0.12 * 0.16, rel=0.2)
