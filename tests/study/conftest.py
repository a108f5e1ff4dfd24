import json
import shutil

import pytest

from drake_aerial.study.campaign import run_study
from drake_aerial.study.plan import StudyPlan

TINY = """
name: tiny
seed: 3
defaults: {trajectory: {kind: hover, hover_time: 0.5}, points: 8000}
conditions:
  - {name: A, title: a box, demonstration: flat, payload: box_68x61x28, view: top}
  - {name: H, title: given, payload: box_68x61x28, contacts: {corner: [[0.3, 0.25, 0.2]]}}
flights:
  - {conditions: [A], methods: [task, centroid], beliefs: [below_contact], solutions: 2, trials: 2}
  - {conditions: [A, H], methods: [task], beliefs: [true], solutions: 1, trials: 1}
"""


@pytest.fixture(scope="session")
def tiny_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("plans") / "tiny.yaml"
    path.write_text(TINY)
    return path


@pytest.fixture(scope="session")
def tiny(tiny_file):
    return StudyPlan.read(tiny_file)


@pytest.fixture(scope="session")
def undisturbed(tiny, tmp_path_factory):
    """The folder of a campaign that ran in one process, start to end; not to be written to."""
    folder = tmp_path_factory.mktemp("studies") / "undisturbed"
    summary = run_study(tiny, folder)
    assert summary.errors == ()
    return folder


@pytest.fixture
def records_of():
    def read(folder):
        """Return the records in the file's order, without their timing."""
        records = [json.loads(line) for line in (folder / "records.jsonl").read_text().splitlines()]
        for record in records:
            assert record.pop("timing") is not None
        return records

    return read


@pytest.fixture
def series_of():
    def read(folder):
        return {path.name: path.read_bytes() for path in (folder / "series").glob("[!.]*")}

    return read


@pytest.fixture
def copy(tmp_path):
    def make(folder):
        return shutil.copytree(folder, tmp_path / "copy")

    return make
