import json
import re
import shutil

import numpy as np
import pytest
from PIL import Image
from scipy import stats

from drake_aerial import cli
from drake_aerial.errors import InputError
from drake_aerial.study.report.study_report import write_report
from tests.study.small_study import method_study, record, write_study

CONDITIONS = [
    {
        "name": "A",
        "title": "flat -> box",
        "demonstration": "flat",
        "payload": "box_68x61x28",
        "view": "top",
    }
]


def all_bytes(folder):
    files = [
        folder / "report.html",
        folder / "summary.json",
        *sorted((folder / "figures").iterdir()),
    ]
    return {path.name: path.read_bytes() for path in files}


def test_three_trials_recomputed(tmp_path):
    values = {"task": [0.021, 0.024, 0.030], "kopicki": [0.11, 0.14]}
    records = [
        record("A", m, 1, t, v) for m, members in values.items() for t, v in enumerate(members)
    ]
    records.append(record("A", "kopicki", 1, 2, 0.5, outcome="dropped"))
    write_study(tmp_path, records, conditions=CONDITIONS)
    write_report(tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    by_method = {g["method"]: g for g in summary["groups"]}
    for method, members in values.items():
        figure = by_method[method]["quantities"]["position_rmse_m"]
        assert figure["mean"] == pytest.approx(np.mean(members))
        assert figure["std"] == pytest.approx(np.std(members, ddof=1))
        velocity = by_method[method]["quantities"]["velocity_rmse_m_s"]
        assert velocity["mean"] == pytest.approx(2 * np.mean(members))
    assert by_method["kopicki"]["dropped"] == 1
    assert by_method["kopicki"]["quantities"]["position_rmse_m"]["median_all"] == pytest.approx(
        0.14
    )
    rate = stats.binomtest(1, 3).proportion_ci(method="wilson")
    np.testing.assert_allclose(by_method["kopicki"]["failure_rate"], [1 / 3, rate.low, rate.high])
    (position,) = [c for c in summary["comparisons"] if c["quantity"] == "position_rmse_m"]
    assert position["difference"][0] == pytest.approx(np.mean([0.021 - 0.11, 0.024 - 0.14]))
    assert position["wins"][0] == 1.0
    assert set(summary["formulas"]) >= {
        "difference",
        "wins",
        "failure_rate",
        "median_all",
        "spread",
        "interval",
    }
    assert all(v == "not tested" for c in summary["claims"] for v in c["verdicts"].values())


def test_the_same_records_in_any_order_are_the_same_report(tmp_path):
    records = method_study(np.random.default_rng(0), conditions=("A",), solutions=3, trials=2)
    for name, order in (("one", None), ("two", np.random.default_rng(5).permutation(len(records)))):
        write_study(tmp_path / name, records, conditions=CONDITIONS, order=order)
        write_report(tmp_path / name)
    one, two = all_bytes(tmp_path / "one"), all_bytes(tmp_path / "two")
    assert len(one) == 6
    assert one == two
    # Timing is no part of it, and a second build changes nothing.
    lines = (tmp_path / "two" / "records.jsonl").read_text().replace('"cpu_s": 1.5', '"cpu_s": 9.5')
    (tmp_path / "two" / "records.jsonl").write_text(lines)
    report = write_report(tmp_path / "two")
    assert all_bytes(tmp_path / "two") == one
    assert report.timing["flights_cpu_s"] == pytest.approx(9.5 * len(records))


def test_the_page_is_self_contained_and_names_every_method(tmp_path):
    write_study(
        tmp_path, method_study(np.random.default_rng(0), conditions=("A",)), conditions=CONDITIONS
    )
    write_report(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert "width=device-width" in page
    assert "flat → box" in page
    assert "1 of 20 failed" in page
    for text in ("task", "kopicki", "The attitude error is lower in all conditions.", "✓ holds"):
        assert text in page
    assert str(tmp_path) not in page


def test_a_corrupted_line_is_reported_and_skipped(tmp_path):
    records = method_study(np.random.default_rng(0), conditions=("A",), solutions=2, trials=1)
    write_study(tmp_path, records, conditions=CONDITIONS, series=False)
    path = tmp_path / "records.jsonl"
    lines = path.read_text().splitlines()
    lines[1] = lines[1][:40]
    path.write_text("\n".join(lines) + "\n")
    report = write_report(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "records.jsonl line 2" in page
    assert any("records.jsonl line 2" in line for line in report.lines)
    assert (
        sum(g["flights"] for g in json.loads((tmp_path / "summary.json").read_text())["groups"])
        == 3
    )


def test_missing_and_broken_series_are_reported(tmp_path):
    records = method_study(np.random.default_rng(0), conditions=("A",), solutions=1, trials=3)
    write_study(tmp_path, records, conditions=CONDITIONS)
    series = sorted((tmp_path / "series").iterdir())
    series[0].unlink()
    series[1].write_bytes(series[1].read_bytes()[:200])
    write_report(tmp_path)
    assert "the series of 2 flight(s) could not be read" in (tmp_path / "report.html").read_text()


def test_without_a_plan_the_records_are_enough(tmp_path):
    write_study(
        tmp_path, method_study(np.random.default_rng(0), solutions=1, trials=1), series=False
    )
    (tmp_path / "study.yaml").unlink()
    write_report(tmp_path)
    assert "study.yaml is missing" in (tmp_path / "report.html").read_text()


def test_a_folder_without_records_is_one_line_and_exit_2(tmp_path, capsys):
    assert cli.main(["report", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "has no records" in error
    with pytest.raises(InputError, match="is not a folder"):
        write_report(tmp_path / "nowhere")
    (tmp_path / "records.jsonl").write_text("{broken\n")
    with pytest.raises(InputError, match="1 lines in it cannot be read"):
        write_report(tmp_path)


def test_the_command_prints_results_and_times(tmp_path, capsys):
    write_study(tmp_path, [record("A", "task", 1, 0, 0.02)], conditions=CONDITIONS, series=False)
    assert cli.main(["report", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "flights: 1, conditions: 1, failed: 0" in out
    assert "1.5 s of processor time" in out
    assert (tmp_path / "report.html").exists()


def test_the_report_of_a_study_has_figures_of_contacts_and_equal_bytes(undisturbed, tmp_path):
    for name in ("one", "two"):
        shutil.copytree(undisturbed, tmp_path / name)
        write_report(tmp_path / name)
    one = all_bytes(tmp_path / "one")
    assert one == all_bytes(tmp_path / "two")
    assert {"contacts-A.png", "contacts-H.png", "flights-A-true-table.png", "offset-A.pdf"} <= set(
        one
    )
    with Image.open(tmp_path / "one" / "figures" / "contacts-A.png") as image:
        colors = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)
    # The quadrotors' blue discs and the contact features' red are there: something was rendered.
    blue = (colors[:, 2] - colors[:, 0] > 60).sum()
    red = (colors[:, 0] - colors[:, 2] > 90).sum()
    assert blue > 500
    assert red > 20
    summary = json.loads((tmp_path / "one" / "summary.json").read_text())
    assert {entry["method"] for entry in summary["saliency_percentile"]} == {
        "task",
        "centroid",
        "corner",
    }
    assert not summary["complaints"]
