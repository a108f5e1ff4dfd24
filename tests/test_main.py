"""Ctrl-C before the command line is loaded: one line and 130, as later."""

import subprocess
import sys

import pytest

INTERRUPTED_WHEN_IMPORTED = """
import os, signal, sys

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
from drake_aerial.__main__ import entry_point
sys.argv = ["drake-aerial", "defaults", "cable"]
sys.exit(entry_point())
"""


@pytest.mark.parametrize("name", ["drake_aerial.cli", "argparse", "drake_aerial.cli.view"])
def test_ctrl_c_while_the_command_line_is_loaded(name):
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_WHEN_IMPORTED.format(name=name)],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 130
    assert done.stderr == "drake-aerial: interrupted; nothing was half-written\n"
    assert done.stdout == ""
