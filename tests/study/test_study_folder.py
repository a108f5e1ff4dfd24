import os
import subprocess
import sys

import numpy as np
import pytest

from drake_aerial import InputError
from drake_aerial.study.records import read_records
from drake_aerial.study.study_folder import StudyFolder
from tests.study.test_records import record


def test_a_record_and_its_series_are_appended(tiny, tmp_path):
    with StudyFolder(tmp_path / "s").opened_for(tiny) as folder:
        folder.append(record("a"), {"time": np.arange(3, dtype=np.float32)})
    assert read_records(tmp_path / "s")[0] == [record("a")]
    assert StudyFolder(tmp_path / "s").series("a")["time"].tolist() == [0.0, 1.0, 2.0]


def test_opening_cuts_off_a_torn_last_line(tiny, tmp_path):
    with StudyFolder(tmp_path).opened_for(tiny) as folder:
        folder.append(record("a"), {})
    path = tmp_path / "records.jsonl"
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"schema": "drake')
    with StudyFolder(tmp_path).opened_for(tiny):
        assert path.read_bytes() == whole


def test_another_study_is_refused_and_the_message_says_what_differs(tiny, tmp_path):
    with StudyFolder(tmp_path).opened_for(tiny):
        pass
    other = tiny.chosen(trials=9)
    with (
        pytest.raises(InputError, match="trials is 2 there, 9 now"),
        StudyFolder(tmp_path).opened_for(other),
    ):
        pass
    (tmp_path / "study.yaml").write_text(
        (tmp_path / "study.yaml").read_text().replace("package_version: ", "package_version: 9.")
    )
    with (
        pytest.raises(InputError, match="flown by version 9"),
        StudyFolder(tmp_path).opened_for(tiny),
    ):
        pass


def test_one_study_writes_to_a_folder_at_a_time(tiny, tmp_path):
    with (
        StudyFolder(tmp_path).opened_for(tiny),
        pytest.raises(InputError, match="another study is writing"),
        StudyFolder(tmp_path).opened_for(tiny),
    ):
        pass
    with StudyFolder(tmp_path).opened_for(tiny):
        pass


def test_a_killed_study_releases_the_folder(tiny, tiny_file, tmp_path):
    script = (
        "import os, signal, sys\n"
        "from drake_aerial.study.plan import StudyPlan\n"
        "from drake_aerial.study.study_folder import StudyFolder\n"
        "with StudyFolder(sys.argv[1]).opened_for(StudyPlan.read(sys.argv[2])):\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    killed = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path), str(tiny_file)], env=os.environ, check=False
    )
    assert killed.returncode == -9
    with StudyFolder(tmp_path).opened_for(tiny):
        pass


def test_a_broken_file_is_a_warning_and_a_missing_one_is_not(undisturbed, copy):
    folder = StudyFolder(copy(undisturbed))
    assert folder.scan("A") is not None
    assert folder.skill("A") is not None
    assert len(folder.contacts("A", "task")) > 0
    assert folder.contacts("A", "kopicki") is None
    assert folder.warnings == []
    folder.scan_path("A").write_bytes(b"PK not an archive")
    folder.contacts_path("A-task").write_text("{}")
    assert folder.scan("A") is None
    assert folder.contacts("A", "task") is None
    assert len(folder.warnings) == 2
    # The report's bytes do not depend on where the folder is.
    assert not any(str(folder.path) in warning for warning in folder.warnings)


def test_timing_of_transfers_and_sessions_adds_up(tmp_path):
    folder = StudyFolder(tmp_path)
    folder.add_timing({"A-task": {"wall_s": 1.0}})
    folder.add_timing({"B-task": {"wall_s": 2.0}}, {"flights": 3})
    folder.add_timing({}, {"flights": 4})
    assert set(folder.timing()["transfers"]) == {"A-task", "B-task"}
    assert folder.timing()["sessions"] == [{"flights": 3}, {"flights": 4}]
