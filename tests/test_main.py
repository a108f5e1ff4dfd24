"""The command line as a process: `python -m drake_aerial` and the installed command."""

import subprocess
import sys

from drake_aerial import __main__, __version__
from drake_aerial.cli import main


def test_the_module_and_the_installed_command_are_the_same():
    assert __main__.entry_point is main
    done = subprocess.run(
        [sys.executable, "-m", "drake_aerial", "--version"], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, f"drake-aerial {__version__}\n")


def test_the_exit_code_is_that_of_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "drake_aerial", "defaults", "nosuch"], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
