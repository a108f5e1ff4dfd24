"""`python -m drake_aerial.cli` is the command line, as `python -m drake_aerial` is."""

import sys

from drake_aerial.cli import main

sys.exit(main())
