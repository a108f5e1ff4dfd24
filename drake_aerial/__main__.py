"""The command line as a process: `drake-aerial`, and `python -m drake_aerial`."""

import sys

from drake_aerial.cli import main as entry_point

if __name__ == "__main__":
    sys.exit(entry_point())
