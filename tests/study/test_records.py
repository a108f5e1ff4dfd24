import json

import pytest

from drake_aerial.study.records import (
    append_record,
    cut_unfinished_line,
    read_records,
    sort_records,
)


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


def test_records_come_back_as_they_were_appended(tmp_path):
    for key in ("a", "b"):
        append_record(tmp_path, record(key))
    records, complaints = read_records(tmp_path)
    assert records == [record("a"), record("b")]
    assert complaints == []


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


def test_a_torn_last_line_is_cut_off(tmp_path):
    append_record(tmp_path, record("a"))
    path = tmp_path / "records.jsonl"
    path.write_bytes(path.read_bytes() + b'{"schema": "drake')
    cut_unfinished_line(tmp_path)
    append_record(tmp_path, record("b"))
    records, complaints = read_records(tmp_path)
    assert [r["key"] for r in records] == ["a", "b"]
    assert complaints == []


def test_sorting_waits_for_the_last_record(tmp_path):
    for key in ("b", "a"):
        append_record(tmp_path, record(key))
    sort_records(tmp_path, ["a", "b", "c"])
    assert [r["key"] for r in read_records(tmp_path)[0]] == ["b", "a"]
    sort_records(tmp_path, ["a", "b"])
    assert [r["key"] for r in read_records(tmp_path)[0]] == ["a", "b"]


def test_numbers_that_json_has_not_are_refused(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        append_record(tmp_path, record("a", metrics={"x": float("nan")}))
    assert read_records(tmp_path) == ([], [])
