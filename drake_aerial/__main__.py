"""`python -m drake_aerial` is the command line."""

import sys

from drake_aerial.cli import entry_point

sys.exit(entry_point())
