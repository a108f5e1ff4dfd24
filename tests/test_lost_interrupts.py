"""An interrupt that falls into an extension's conversion of arguments is dropped there; the command ends all the same."""

import subprocess
import sys
import textwrap

import pytest

DROPPED = """
    import signal
    from drake_aerial.cli import VERBS, main
    from drake_aerial.cli.interrupts import heed
    from drake_aerial.cli.progress import progress_bar, progress_log

    def run(arguments):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            pass
        {then}

    VERBS[-1].run = run
    assert heed() is None
    code = main(["defaults", "study"])
    assert heed() is None, "the next command would end of it"
    raise SystemExit(code)
"""


@pytest.mark.parametrize(
    "then",
    [
        'raise TypeError("incompatible function arguments")',
        'progress_log("study")(0.5, "flight 3/6"); return 0',
        'update = progress_bar("study").__enter__(); update(0.5); return 0',
    ],
    ids=["an error", "the next line in a log", "the next step of a bar"],
)
def test_a_dropped_interrupt_is_an_interrupt(then):
    code = textwrap.dedent(DROPPED).replace("{then}", then)
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120
    )
    assert ended.returncode == 130, ended.stderr
    assert ended.stderr.splitlines()[-1].endswith("interrupted; nothing was half-written")
    assert "Traceback" not in ended.stderr


def test_an_interrupt_that_a_command_ends_by_is_none_to_others():
    # A server is ended by Ctrl-C and has done its job.
    code = textwrap.dedent(DROPPED).replace("{then}", "return 0")
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=120).returncode
        == 0
    )
