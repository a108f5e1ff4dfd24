"""Damaged files of every kind: a result or one InputError, in bounded time and memory."""

import json
import tempfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import strategies as st

from drake_aerial import (
    ContactSkill,
    ContactSolutions,
    Demonstration,
    InputError,
    Payload,
    PointCloud,
    StudyPlan,
    TrialResult,
    compute_features,
    read_depth_image,
    read_parameters,
    read_skill,
    transfer,
)
from drake_aerial.configuration import NOUNS, defaults_text
from drake_aerial.io import model_files
from drake_aerial.references.trajectory_files import read_trajectory
from drake_aerial.visualization.file_view import write_view
from tests.fuzz.bounds import bounded, ends_well, fuzzed
from tests.fuzz.hostile import (
    HOSTILE_YAML,
    Opened,
    bomb,
    cloud_files,
    damage,
    depth_images,
    documents,
    header_of,
    npz,
    points,
)


def written(name, content):
    path = Path(tempfile.mkdtemp(prefix="fuzz_")) / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def check_cloud_file(drawn):
    suffix, content = drawn
    cloud = ends_well(PointCloud.read, written(f"scan{suffix}", content))
    if cloud is not None:
        assert np.isfinite(cloud.points).all()
        features = ends_well(compute_features, cloud)
        if features is not None:
            assert np.isfinite(features.p).all()
            assert np.isfinite(features.r).all()


test_cloud_files, test_cloud_files_many = fuzzed(
    check_cloud_file, cloud_files(), short=60, long=4000
)


def check_depth_image(drawn):
    depth, camera = drawn
    cloud = ends_well(read_depth_image, depth, camera)
    if cloud is not None:
        assert np.isfinite(cloud.points).all()
        assert len(cloud) + cloud.dropped_points == depth.size


test_depth_images, test_depth_images_many = fuzzed(
    check_depth_image, depth_images(), short=60, long=4000
)


def check_array(p):
    cloud = ends_well(PointCloud.read, p)
    if cloud is not None:
        ends_well(compute_features, cloud)
        ends_well(Payload.from_cloud, cloud)


test_arrays, test_arrays_many = fuzzed(check_array, points(), short=30, long=1500)

GOOD = {
    name: yaml.safe_load((model_files.models_dir() / folder / f"{name}.yaml").read_text())
    for folder, name in (
        ("demonstrations", "flat"),
        ("demonstrations", "bar"),
        ("payloads", "box_68x61x28"),
        ("payloads", "bunny"),
    )
}


def check_demonstration(document):
    ends_well(Demonstration.read, written("shown.yaml", yaml.safe_dump(document)))


test_demonstrations, test_demonstrations_many = fuzzed(
    check_demonstration,
    st.one_of(documents(GOOD["flat"]), documents(GOOD["bar"])),
    short=30,
    long=1000,
)


def check_payload(document):
    ends_well(Payload.read, written("payload.yaml", yaml.safe_dump(document)))


test_payloads, test_payloads_many = fuzzed(
    check_payload,
    st.one_of(documents(GOOD["box_68x61x28"]), documents(GOOD["bunny"])),
    short=30,
    long=1000,
)

PLAN = yaml.safe_load((model_files.models_dir() / "studies" / "paper.yaml").read_text())


def check_plan(document):
    ends_well(StudyPlan.read, written("plan.yaml", yaml.safe_dump(document)))


test_plans, test_plans_many = fuzzed(check_plan, documents(PLAN), short=15, long=500)

PARAMETERS = {noun: yaml.safe_load(defaults_text(noun)) for noun in NOUNS if noun != "payload"}


def check_parameters(noun, data):
    document = data.draw(documents(PARAMETERS[noun]))
    ends_well(read_parameters, noun, written("parameters.yaml", yaml.safe_dump(document)))


test_parameters, test_parameters_many = fuzzed(
    check_parameters, st.sampled_from(sorted(PARAMETERS)), st.data(), short=60, long=2000
)

PATHS = [
    {"kind": "transport", "radius": 1.0},
    {"kind": "line", "goal": [1.0, 0.0, 1.0]},
    {"kind": "waypoints", "waypoints": [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]},
    {"kind": "hover", "hover_time": 1.0},
]


def check_trajectory(document):
    path = ends_well(read_trajectory, written("path.yaml", yaml.safe_dump(document)))
    if path is not None and path.duration < 1e4:
        assert np.isfinite(path.sample(np.linspace(0.0, path.duration, 7)).p).all()


test_trajectories, test_trajectories_many = fuzzed(
    check_trajectory, st.one_of(*map(documents, PATHS)), short=40, long=1000
)


@pytest.fixture(scope="module")
def skill():
    return read_skill("flat")


@pytest.mark.parametrize("text", HOSTILE_YAML, ids=range(len(HOSTILE_YAML)))
@pytest.mark.parametrize(
    "read", [Demonstration.read, Payload.read, StudyPlan.read, read_trajectory]
)
def test_hostile_yaml_is_refused_in_one_line(read, text):
    with bounded(), pytest.raises(InputError) as refused:
        read(written("hostile.yaml", text))
    assert len(str(refused.value)) < 2000


def archive_of(skill):
    return skill.to_bytes()


def test_damaged_skills(skill):
    _skills(archive_of(skill), 150)


@pytest.mark.fuzz
def test_damaged_skills_many(skill):
    _skills(archive_of(skill), 1000)


def _skills(good, count):
    """Check archives with flipped and cut bytes, and with valid checksums but changed arrays."""
    import io

    rng = np.random.default_rng(0)
    arrays = dict(np.load(io.BytesIO(good)))
    for k in range(count):
        if k % 3 == 0:
            data = bytearray(good)
            for at in rng.integers(0, len(data), 4):
                data[at] = rng.integers(256)
            content = bytes(data[: rng.integers(1, len(data))] if k % 2 else data)
        else:
            changed = dict(arrays)
            name = str(rng.choice(sorted(changed)))
            value = changed[name]
            kind = int(rng.integers(7))
            if kind == 0:
                del changed[name]
            elif kind == 1:
                changed[name] = np.array("nonsense")
            elif kind == 2:
                changed[name] = np.zeros((0, *value.shape[1:])) if value.ndim else np.array([1, 2])
            elif kind == 3:
                changed[name] = value[..., :-1] if value.ndim else np.array(10**9)
            elif kind == 4:
                changed[name] = (
                    np.full(value.shape, np.nan) if value.dtype.kind == "f" else np.array(-1)
                )
            elif kind == 5:
                changed[name] = np.array(
                    json.dumps({"grippers": 10**9, "parameters": [], "rho": "x"})
                )
            else:
                changed[name] = np.arange(5)
            content = npz(**changed)
        ends_well(ContactSkill.load, written("skill.npz", content))


CONTACTS = {}


def contacts_document():
    if not CONTACTS:
        found = transfer(read_skill("flat"), PointCloud.read(np.array(_box())), method="centroid")
        CONTACTS.update(found.to_dict())
    return CONTACTS


def _box():
    import trimesh

    return trimesh.sample.sample_surface(trimesh.creation.box((0.5, 0.4, 0.2)), 4000, seed=0)[0]


def check_contacts(data):
    document = data.draw(documents(contacts_document()))
    text = json.dumps(document)
    content = data.draw(damage(text.encode()))
    ends_well(ContactSolutions.read, written("contacts.json", content))


test_contacts, test_contacts_many = fuzzed(check_contacts, st.data(), short=60, long=2000)


@pytest.mark.parametrize(
    "content",
    [
        "[" * 100_000,
        '{"schema": ' * 5000,
        "1e999",
        '{"schema": "drake_aerial/contacts", "version": 1e999}',
        "NaN",
        "",
        "\x00",
    ],
)
def test_hostile_json_is_refused(content):
    with bounded(), pytest.raises(InputError):
        ContactSolutions.read(written("contacts.json", content))


@pytest.mark.parametrize(
    "content",
    [
        npz(metrics=np.array("[" * 50_000)),
        npz(metrics=np.array("[]")),
        npz(metrics=np.array('{"schema": "drake_aerial/trial", "version": 1}')),
        npz(metrics=np.array([Opened()], dtype=object)),
        bomb("metrics.npy"),
        header_of((10**15,)),
        b"",
        b"PK\x03\x04",
    ],
    ids=["nested", "a list", "without series", "pickle", "bomb", "header", "empty", "stub"],
)
def test_hostile_trials_and_skills_are_refused(content):
    path = written("trial.npz", content)
    for read in (TrialResult.load, ContactSkill.load, write_view):
        with bounded(), pytest.raises(InputError):
            read(path, *([path.with_suffix(".html")] if read is write_view else []))
    assert not path.with_suffix(".html").exists()


def test_a_mesh_outside_of_the_packages_models_is_refused():
    for uri in ("package://drake_aerial/../../secret.obj", "package://drake_aerial//etc/passwd"):
        with pytest.raises(InputError, match="must be a file of the package's models"):
            Payload.read(written("payload.yaml", yaml.safe_dump({"mass": 1.0, "mesh": uri})))
