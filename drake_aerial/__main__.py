"""`python -m drake_aerial` is the command line."""

import sys

from drake_aerial.cli import main

sys.exit(main())
