"""`python -m drake_aerial.cli` is the command line, as `python -m drake_aerial` is."""

import sys

from drake_aerial.__main__ import entry_point

sys.exit(entry_point())
