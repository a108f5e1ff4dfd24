"""Studies with any number of workers, killed at any time, give the same records."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from drake_aerial import InputError, run_study
from drake_aerial.study import campaign
from drake_aerial.study.records import read_records
from drake_aerial.study.trials import fly_trial

pytest.importorskip("distributed")


def test_a_study_has_a_record_for_every_planned_trial(undisturbed, tiny, records_of):
    records = records_of(undisturbed)
    assert [
        (r["condition"], r["method"], r["belief"], r["solution"], r["trial"]) for r in records
    ] == [
        *(("A", "task", "below_contact", s, k) for s in (1, 2) for k in (0, 1)),
        *(("A", "centroid", "below_contact", 1, k) for k in (0, 1)),
        ("A", "task", "true", 1, 0),
        ("H", "corner", "true", 1, 0),
    ]
    assert {r["outcome"] for r in records} <= {"completed", "crashed", "diverged", "dropped"}
    for record in records:
        assert (undisturbed / "series" / f"{record['key']}.npz").is_file()
    for name in (
        "study.yaml",
        "scans/A.npz",
        "skills/flat.npz",
        "contacts/A-task.json",
        "contacts/H-corner.json",
    ):
        assert (undisturbed / name).is_file()
    # The corner is given 40 cm from the middle; what is learnt from the middle stays there.
    off = {r["method"]: r["contact"]["off_com_m"] for r in records}
    assert off["corner"] == pytest.approx((0.3**2 + 0.25**2) ** 0.5)
    assert off["task"] < 0.03


def test_workers_in_other_processes_write_the_same_records(
    undisturbed, tiny, tmp_path, records_of, series_of
):
    summary = run_study(tiny, tmp_path, workers=2)
    assert summary.errors == ()
    assert (summary.planned, summary.found, summary.flown) == (8, 0, 8)
    assert records_of(tmp_path) == records_of(undisturbed)
    assert series_of(tmp_path) == series_of(undisturbed)


def test_a_finished_study_flies_nothing_more(undisturbed, tiny, tmp_path, copy):
    folder = copy(undisturbed)
    before = (folder / "records.jsonl").read_bytes()
    summary = run_study(tiny, folder)
    assert (summary.found, summary.flown) == (8, 0)
    assert (folder / "records.jsonl").read_bytes() == before


def test_missing_and_damaged_records_are_flown_again(undisturbed, tiny, copy, records_of):
    folder = copy(undisturbed)
    lines = (folder / "records.jsonl").read_text().splitlines()
    damaged = [
        lines[5],
        lines[0],
        lines[1][: len(lines[1]) // 2],
        *lines[6:],
        lines[3] + "\n" + lines[4][:40],
    ]
    (folder / "records.jsonl").write_text("\n".join(damaged))
    summary = run_study(tiny, folder)
    assert (summary.found, summary.flown) == (5, 3)
    # The damaged line in the middle is reported; the torn end was never a record.
    assert len(summary.complaints) == 1
    assert "line 3" in summary.complaints[0]
    records, _ = read_records(folder)
    for record in records:
        record.pop("timing")
    assert sorted(records, key=lambda r: r["key"]) == sorted(
        records_of(undisturbed), key=lambda r: r["key"]
    )


def test_records_of_other_inputs_are_refused(undisturbed, tiny, copy):
    folder = copy(undisturbed)
    path = folder / "records.jsonl"
    path.write_text(
        path.read_text().replace(json.loads(path.read_text().splitlines()[0])["key"], "f" * 24)
    )
    with pytest.raises(InputError, match="records of another study"):
        run_study(tiny, folder)


def test_an_unexpected_error_leaves_its_trial_without_a_record(
    undisturbed, tiny, copy, monkeypatch, records_of
):
    folder = copy(undisturbed)
    lines = (folder / "records.jsonl").read_text().splitlines()
    (folder / "records.jsonl").write_text("\n".join(lines[:4]) + "\n")

    def broken(task):
        if task.method == "centroid" and task.trial == 1:
            raise ZeroDivisionError("a defect\nin two lines")
        return fly_trial(task)

    monkeypatch.setattr(campaign, "fly_trial", broken)
    summary = run_study(tiny, folder)
    assert len(summary.errors) == 1
    assert "A centroid" in summary.errors[0]
    assert summary.errors[0].endswith("ZeroDivisionError: a defect in two lines")
    assert summary.flown == 3
    monkeypatch.undo()
    assert run_study(tiny, folder).flown == 1
    assert records_of(folder) == records_of(undisturbed)


def test_progress_grows_to_the_end(tiny, undisturbed, copy):
    folder = copy(undisturbed)
    lines = (folder / "records.jsonl").read_text().splitlines()
    (folder / "records.jsonl").write_text("\n".join(lines[:6]) + "\n")
    told = []
    run_study(tiny, folder, progress=lambda fraction, what: told.append((fraction, what)))
    fractions = [fraction for fraction, _ in told]
    assert fractions == sorted(fractions)
    assert fractions[0] == pytest.approx(6 / 8)
    assert fractions[-1] == 1.0
    assert told[0][1] == "flight 6/8"
    assert told[-1][1].startswith("flight 8/8, 0 s left")


def test_a_missing_scheduler_is_an_input_error(tiny, tmp_path):
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        run_study(tiny, tmp_path, scheduler="not an address")


KILLED = """
import sys
from drake_aerial import run_study
if __name__ == "__main__":
    run_study(sys.argv[1], sys.argv[2], workers=int(sys.argv[3]))
"""


def children_of(pid):
    """Return the worker processes below a process, by their command."""
    import psutil

    return [
        p
        for p in psutil.Process(pid).children(recursive=True)
        if "spawn_main" in " ".join(p.cmdline())
    ]


def wait_for_records(folder, count, process, seconds=120.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if (folder / "records.jsonl").exists() and (folder / "records.jsonl").read_bytes().count(
            b"\n"
        ) >= count:
            return
        assert process.poll() is None, process.stderr.read().decode()
        time.sleep(0.02)
    raise AssertionError("no records in time")


def test_killing_a_worker_and_then_the_study_changes_nothing(
    undisturbed, tiny_file, tmp_path, records_of, series_of
):
    script = tmp_path / "campaign.py"
    script.write_text(KILLED)
    out = tmp_path / "out"
    command = [sys.executable, str(script), str(tiny_file), str(out), "1"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE)
    try:
        wait_for_records(out, 1, process)
        workers = children_of(process.pid)
        assert workers
        for worker in workers:
            os.kill(worker.pid, signal.SIGKILL)
        # A new worker goes on with the trial that the old one died of.
        wait_for_records(out, 4, process)
        orphans = children_of(process.pid)
        os.kill(process.pid, signal.SIGKILL)
    finally:
        process.kill()
        process.wait()
    import psutil

    assert psutil.wait_procs(orphans, timeout=30)[1] == []
    summary = run_study(tiny_file, out)
    assert summary.errors == ()
    assert summary.found >= 4
    assert summary.found + summary.flown == 8
    assert records_of(out) == records_of(undisturbed)
    assert series_of(out) == series_of(undisturbed)
