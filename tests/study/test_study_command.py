import json

import pytest

from drake_aerial.cli import main


@pytest.fixture
def run(capsys):
    def call(*arguments):
        try:
            code = main(["study", *(str(argument) for argument in arguments)])
        except SystemExit as stop:  # argparse
            code = stop.code
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call


def test_a_study_from_the_shell_ends_with_its_report(run, tiny_file, tmp_path):
    out = tmp_path / "out"
    chosen = (
        "--plan",
        tiny_file,
        "--out",
        out,
        "--conditions",
        "A",
        "--methods",
        "task",
        "--beliefs",
        "true",
        "--workers",
        0,
    )
    code, text, err = run(*chosen, "--json")
    assert code == 0, err
    # How many flights it is going to be is said before they are flown.
    assert "1 flights at most, in this process" in err.splitlines()[0]
    summary = json.loads(text)
    assert (summary["planned"], summary["found"], summary["flown"]) == (1, 0, 1)
    assert (out / "report.html").is_file()
    report = (out / "report.html").read_bytes()
    code, text, _ = run(*chosen)
    assert code == 0
    assert text.startswith("1 of 1 records (1 of them before): 1 completed")
    assert (out / "report.html").read_bytes() == report
    # Another choice is another study.
    code, _, err = run(*chosen, "--trials", 2)
    assert code == 2
    assert "trials is 1 there, 2 now" in err


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--plan", "papper"), "papper"),
        (("--conditions", "Z"), "A, A_full, B"),
        (("--methods", "tusk"), "'task'"),
        (("--beliefs", "geometric"), "below_contact, true"),
        (("--workers", "-1"), "whole number"),
        (("--trials", "0"), "whole number"),
        (("--scheduler", "nowhere", "--workers", "1"), "not allowed"),
        (("--scheduler", "nowhere"), "no Dask scheduler answers"),
    ],
)
def test_bad_input_exits_2_and_is_named(run, tmp_path, arguments, word):
    code, out, err = run("--out", tmp_path / "out", *arguments)
    assert code == 2
    assert out == ""
    assert word in err
