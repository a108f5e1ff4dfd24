"""YAML and JSON that expand without bound are refused under keys that every reader knows."""

import json

import numpy as np
import pytest
import yaml

from drake_aerial import (
    ContactSkill,
    ContactSolutions,
    Demonstration,
    InputError,
    Payload,
    StudyPlan,
    TrialResult,
    read_parameters,
)
from drake_aerial.configuration import NOUNS, defaults_text
from drake_aerial.io.strict_yaml import MOST_LEVELS, MOST_VALUES, read_json, read_mapping
from drake_aerial.references.trajectory_files import read_trajectory
from drake_aerial.study.records import read_records
from drake_aerial.study.study_folder import StudyFolder
from tests.fuzz.bounds import bounded
from tests.fuzz.hostile import npz

LAUGHS = ", ".join(
    ["&a0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]"]
    + [f"&a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
)
"""Aliases that stand for 10^9 zeros."""
MERGES = ", ".join(
    ["&b0 {x: 0}"] + [f"&b{n} {{<<: [{', '.join([f'*b{n - 1}'] * 10)}]}}" for n in range(1, 9)]
)
"""Merge keys that stand for 10^8 entries."""
DEEP = "[" * (MOST_LEVELS + 1) + "]" * (MOST_LEVELS + 1)
HOSTILE = {
    "a list that holds itself": ("&a [*a]", "contains itself"),
    "a mapping that holds itself": ("&a {length: *a}", "contains itself"),
    "a mapping merged into itself": ("&a {<<: *a}", "contains itself"),
    "exponential aliases": (f"[{LAUGHS}]", f"stands for more than {MOST_VALUES:,} values"),
    "exponential merges": (f"[{MERGES}]", f"stands for more than {MOST_VALUES:,} values"),
    "deep nesting": (DEEP, f"more than {MOST_LEVELS} levels deep"),
    "a number in base 60": ("1" + ":59" * 20_000, "more than 1,000 digits"),
}


def known_keys():
    """Return a reader and one of its keys per noun and file."""
    keys = {}
    for noun in NOUNS:
        key = next(iter(yaml.safe_load(defaults_text(noun))))
        keys[noun] = (lambda path, noun=noun: read_parameters(noun, path), key)
    return {
        **keys,
        "demonstration": (Demonstration.read, "grippers"),
        "payload file": (Payload.read, "com"),
        "study plan": (StudyPlan.read, "conditions"),
        "trajectory": (read_trajectory, "goal"),
    }


READERS = known_keys()


@pytest.mark.parametrize("hostile", HOSTILE)
@pytest.mark.parametrize("reader", READERS)
def test_a_document_without_bound_is_refused_under_a_known_key(reader, hostile, tmp_path):
    read, key = READERS[reader]
    value, word = HOSTILE[hostile]
    path = tmp_path / "file.yaml"
    path.write_text(f"{key}: {value}\n")
    with bounded(), pytest.raises(InputError, match=word) as refused:
        read(path)
    assert str(refused.value).startswith(str(path))
    assert len(str(refused.value)) < len(str(path)) + 200


@pytest.mark.parametrize("hostile", HOSTILE)
def test_a_study_folder_refuses_a_plan_without_bound(hostile, tmp_path):
    value, word = HOSTILE[hostile]
    (tmp_path / "study.yaml").write_text(f"conditions: {value}\n")
    plan = StudyPlan.read("paper")
    folder = StudyFolder(tmp_path)
    with bounded(), pytest.raises(InputError, match=word), folder.opened_for(plan):
        pass
    with bounded():
        assert folder.plan == {}
    assert word in folder.warnings[0]


@pytest.mark.parametrize("depth", [MOST_LEVELS + 1, 100_000])
def test_deep_json_is_refused_by_every_reader(depth, tmp_path):
    deep = "[" * depth + "]" * depth
    contacts = '{"schema": "drake_aerial/contacts", "version": 1, "parameters": ' + deep + "}"
    (tmp_path / "contacts.json").write_text(contacts)
    with bounded(), pytest.raises(InputError, match=r"levels deep|not JSON"):
        ContactSolutions.read(tmp_path / "contacts.json")
    metrics = '{"schema": "drake_aerial/trial", "version": 1, "options": ' + deep + "}"
    (tmp_path / "trial.npz").write_bytes(npz(metrics=np.array(metrics)))
    with bounded(), pytest.raises(InputError, match=r"levels deep|not JSON"):
        TrialResult.load(tmp_path / "trial.npz")
    skill = ContactSkill.load(_skill(tmp_path)).to_bytes()
    (tmp_path / "skill.npz").write_bytes(skill)
    arrays = dict(np.load(tmp_path / "skill.npz"))
    arrays["metadata"] = np.array(f'{{"parameters": {deep}}}')
    (tmp_path / "skill.npz").write_bytes(npz(**arrays))
    with bounded(), pytest.raises(InputError, match=r"levels deep|not JSON"):
        ContactSkill.load(tmp_path / "skill.npz")
    (tmp_path / "timing.json").write_text(f'{{"transfers": {deep}}}')
    with bounded():
        assert StudyFolder(tmp_path).timing() == {"transfers": {}, "sessions": []}
    (tmp_path / "records.jsonl").write_text(f'{{"schema": {deep}}}\n')
    with bounded():
        assert read_records(tmp_path) == (
            [],
            ["records.jsonl line 1 is damaged or cut short; left out"],
        )


def _skill(folder):
    from drake_aerial import read_skill

    path = folder / "good.npz"
    read_skill("flat").save(path)
    return path


def test_honest_aliases_and_merges_are_read(tmp_path):
    path = tmp_path / "station.yaml"
    path.write_text(
        "quadrotor: [&strong {mass: 0.5}, *strong, {<<: *strong, mass: 0.4}]\n"
        "cable: {length: 0.7}\n"
    )
    masses = [q.mass for q in read_parameters("station", path).quadrotors(3)]
    assert masses == [0.5, 0.5, 0.4]


def test_documents_at_the_bounds_are_read(tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(f"key: {DEEP[1:-1]}\n".replace("[[", "[", 1).replace("]]", "]", 1))
    assert read_mapping(path)["key"]
    path.write_text(f"key: [{'0, ' * (MOST_VALUES - 4)}0]\n")
    assert len(read_mapping(path)["key"]) == MOST_VALUES - 3
    path.write_text(json.dumps({"key": list(range(2 * MOST_VALUES))}))
    assert len(read_json(path)["key"]) == 2 * MOST_VALUES


def test_one_value_beyond_the_bound_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("drake_aerial.io.strict_yaml.MOST_VALUES", 1000)
    path = tmp_path / "file.yaml"
    path.write_text(f"key: [{'0, ' * 996}0]\n")
    assert len(read_mapping(path)["key"]) == 997
    path.write_text(f"key: [{'0, ' * 997}0]\n")
    with pytest.raises(InputError, match="stands for more than 1,000 values"):
        read_mapping(path)


def test_a_long_file_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    monkeypatch.setattr("drake_aerial.io.strict_yaml.MOST_BYTES", 1000)
    path = tmp_path / "file"
    path.write_text(f"key: [{'0, ' * 500}0]\n")
    for read in (read_mapping, read_json):
        with pytest.raises(InputError, match="is longer than 1,000 bytes"):
            read(path)
