"""Skill files: bit-equal, without pickle, with schema and version, other files refused."""

import io
import json
import zipfile

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.skill.contact_skill import ContactSkill
from drake_aerial.skill.demonstration import Demonstration
from drake_aerial.skill.learn import learn
from drake_aerial.skill.parameters import LearningParameters


@pytest.fixture(scope="module")
def skill():
    return learn(Demonstration.read("flat"))


@pytest.fixture
def path(skill, tmp_path):
    skill.save(tmp_path / "flat.npz")
    return tmp_path / "flat.npz"


def rewritten(path, **changes):
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files} | changes
    buffer = io.BytesIO()
    np.savez(buffer, **{name: value for name, value in arrays.items() if value is not None})
    path.write_bytes(buffer.getvalue())
    return path


def test_reloads_bit_equal(skill, path):
    again = ContactSkill.load(path)
    assert again.to_bytes() == skill.to_bytes() == path.read_bytes()
    for a, b in [
        (again.task.salient.p, skill.task.salient.p),
        (again.contacts[0].X_vG.q, skill.contacts[0].X_vG.q),
        (again.objects[0].features.r, skill.objects[0].features.r),
        (again.hull.vertices, skill.hull.vertices),
        (again.configuration.p_FQ, skill.configuration.p_FQ),
    ]:
        np.testing.assert_array_equal(a, b)
    assert again.parameters == skill.parameters
    np.testing.assert_array_equal(
        again.task.density.log_descriptor_density(np.array([0.3, 0.1])),
        skill.task.density.log_descriptor_density(np.array([0.3, 0.1])),
    )


def test_is_labelled_with_schema_and_version(path):
    with np.load(path, allow_pickle=False) as archive:
        assert str(archive["schema"]) == "drake_aerial/skill"
        assert int(archive["version"]) == 1
        assert str(archive["label"]) == "flat"
        assert not any(archive[name].dtype == object for name in archive.files)


def test_files_of_programs_with_alpha_are_read_and_written(skill, path):
    # Programs before its removal wrote `alpha` twice, and require it in the configuration.
    with np.load(path) as archive:
        metadata = json.loads(str(archive["metadata"]))
    assert metadata["configuration"]["alpha"] == pytest.approx(50.0)
    metadata["configuration"]["alpha"] = metadata["parameters"]["alpha"] = 12.5
    old = ContactSkill.load(rewritten(path, metadata=np.array(json.dumps(metadata))))
    assert old.to_bytes() == skill.to_bytes()
    with pytest.raises(TypeError, match="alpha"):
        LearningParameters(alpha=12.5)


def test_no_temporary_file_is_left(path):
    assert [file.name for file in path.parent.iterdir()] == ["flat.npz"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"schema": np.array("other/thing")}, "'other/thing'"),
        ({"schema": None}, "'none'"),
        ({"version": np.array(2)}, "`version` must be 1, got 2"),
        ({"version": None}, "`version` must be 1, got None"),
        ({"hull": None}, "incomplete or damaged"),
        ({"metadata": np.array("{")}, "incomplete or damaged"),
    ],
)
def test_refuses_other_schemas_and_versions(path, changes, message):
    with pytest.raises(InputError) as caught:
        ContactSkill.load(rewritten(path, **changes))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_refuses_what_is_no_skill(tmp_path):
    missing, text, array = tmp_path / "missing.npz", tmp_path / "text.npz", tmp_path / "array.npz"
    text.write_text("no archive")
    np.save(array.open("wb"), np.zeros(3))
    with zipfile.ZipFile(tmp_path / "cut.npz", "w") as archive:
        archive.writestr("schema.npy", b"cut")
    pickled = tmp_path / "pickled.npz"
    np.savez(pickled, schema=np.array({"a": 1}, dtype=object))
    for file in (missing, text, array, tmp_path / "cut.npz", pickled):
        with pytest.raises(InputError, match="skill"):
            ContactSkill.load(file)
