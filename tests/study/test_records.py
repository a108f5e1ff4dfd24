import json
import os
import subprocess
import sys

import numpy as np
import pytest

from drake_aerial import InputError
from drake_aerial.study.records import StudyFolder, read_records
from drake_aerial.study.trials import FlownTrial


def record(key, **changes):
    fields = {
        "condition": "A",
        "method": "task",
        "belief": "true",
        "inertia": "table",
        "rank": 1,
        "trial": 0,
    }
    fields |= {"outcome": "completed", "metrics": {"position_rmse_m": 0.1}}
    return {"schema": "drake_aerial/study_record", "version": 1, "key": key, **fields, **changes}


def flown(key):
    return FlownTrial(record(key), {"time": np.arange(3, dtype=np.float32)}, 1)


def test_records_come_back_as_they_were_appended(tiny, tmp_path):
    with StudyFolder.opened(tmp_path / "s", tiny) as folder:
        for key in ("a", "b"):
            folder.append(flown(key))
    records, complaints = read_records(tmp_path / "s")
    assert records == [record("a"), record("b")]
    assert complaints == []
    with np.load(tmp_path / "s" / "series" / "a.npz") as series:
        assert series["time"].tolist() == [0.0, 1.0, 2.0]


def test_damaged_lines_are_reported_and_left_out(tmp_path):
    lines = [
        json.dumps(record("a")),
        '{"schema": "drake_aerial/study_rec',
        "\x00\x00\x00",
        json.dumps(record("b", schema="drake_aerial/song")),
        json.dumps({**record("c"), "version": 2}),
        json.dumps({k: v for k, v in record("d").items() if k != "outcome"}),
        "[1, 2]",
        "",
        json.dumps(record("a", trial=7)),
        json.dumps(record("e")),
    ]
    (tmp_path / "records.jsonl").write_text("\n".join(lines) + "\n")
    records, complaints = read_records(tmp_path)
    assert [r["key"] for r in records] == ["a", "e"]
    assert records[0]["trial"] == 0
    assert [int(c.split(" line ")[1].split()[0]) for c in complaints] == [2, 3, 4, 5, 6, 7, 9]
    assert "outcome" in complaints[4]
    assert "repeats" in complaints[6]


def test_no_records_yet(tmp_path):
    assert read_records(tmp_path) == ([], [])


def test_a_torn_last_line_is_cut_off_when_the_campaign_goes_on(tiny, tmp_path):
    with StudyFolder.opened(tmp_path, tiny) as folder:
        folder.append(flown("a"))
    path = tmp_path / "records.jsonl"
    path.write_bytes(path.read_bytes() + b'{"schema": "drake')
    with StudyFolder.opened(tmp_path, tiny) as folder:
        folder.append(flown("b"))
    records, complaints = read_records(tmp_path)
    assert [r["key"] for r in records] == ["a", "b"]
    assert complaints == []


def test_another_study_is_refused_by_what_differs(tiny, tmp_path):
    with StudyFolder.opened(tmp_path, tiny):
        pass
    other = tiny.chosen(trials=9)
    with (
        pytest.raises(InputError, match="trials is 2 there, 9 now"),
        StudyFolder.opened(tmp_path, other),
    ):
        pass
    (tmp_path / "study.yaml").write_text(
        (tmp_path / "study.yaml").read_text().replace("package_version: ", "package_version: 9.")
    )
    with pytest.raises(InputError, match="flown by version 9"), StudyFolder.opened(tmp_path, tiny):
        pass


def test_one_campaign_at_a_time(tiny, tmp_path):
    with (
        StudyFolder.opened(tmp_path, tiny),
        pytest.raises(InputError, match="another study is writing"),
        StudyFolder.opened(tmp_path, tiny),
    ):
        pass
    with StudyFolder.opened(tmp_path, tiny):
        pass


def test_whoever_is_killed_lets_go(tiny, tiny_file, tmp_path):
    script = (
        "import os, signal, sys\n"
        "from drake_aerial.study.plan import StudyPlan\n"
        "from drake_aerial.study.records import StudyFolder\n"
        "with StudyFolder.opened(sys.argv[1], StudyPlan.read(sys.argv[2])):\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    killed = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path), str(tiny_file)], env=os.environ, check=False
    )
    assert killed.returncode == -9
    with StudyFolder.opened(tmp_path, tiny):
        pass


def test_sorting_waits_for_the_last_record(tiny, tmp_path):
    with StudyFolder.opened(tmp_path, tiny) as folder:
        for key in ("b", "a"):
            folder.append(flown(key))
        folder.sort(["a", "b", "c"])
        assert [r["key"] for r in read_records(tmp_path)[0]] == ["b", "a"]
        folder.sort(["a", "b"])
        assert [r["key"] for r in read_records(tmp_path)[0]] == ["a", "b"]


def test_numbers_that_json_has_not_are_refused(tiny, tmp_path):
    bad = FlownTrial(record("a", metrics={"x": float("nan")}), {}, 1)
    with StudyFolder.opened(tmp_path, tiny) as folder, pytest.raises(ValueError, match="JSON"):
        folder.append(bad)
    assert read_records(tmp_path) == ([], [])
