import numpy as np
import pytest

from drake_aerial.study.report.study_page import verdict_mark
from drake_aerial.study.report.study_report import write_report
from tests.study.small_study import method_study, write_study


def test_names_from_files_are_escaped(tmp_path):
    records = method_study(np.random.default_rng(0), conditions=("A",), solutions=1, trials=1)
    for record in records:
        record["outcome_reason"] = "<script>reason</script>"
        record["reasons"] = ["<script>reason</script>"]
    records[0] |= {"outcome": "not_flown", "solution": None}
    bad = {"name": "A", "title": "<script>title</script>", "payload": "<b>box</b>"}
    write_study(tmp_path, records, conditions=[bad], series=False)
    write_report(tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "<script>" not in page
    assert "<b>box" not in page
    for text in ("&lt;script&gt;title", "&lt;script&gt;reason", "&lt;b&gt;box"):
        assert text in page


@pytest.mark.parametrize(
    ("word", "sign"),
    [
        ("holds", "✓"),
        ("holds under belief true", "✓"),
        ("holds in A only", "◐"),
        ("holds under belief true; undecided under geometric", "◐"),
        ("does not hold under true; undecided under geometric", "◐"),
        ("does not hold", "✗"),
        ("reversed", "✗"),
        ("undecided", "?"),
        ("not tested", "–"),
    ],
)
def test_a_verdict_has_a_sign(word, sign):
    assert verdict_mark(word)[1] == sign
