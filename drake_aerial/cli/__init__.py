"""The command line: thin, every verb reads its arguments and calls one public function.

Results go to files; stdout carries one line of JSON with ``--json``, a short summary otherwise; errors and progress go to
stderr. Exit codes: 0 done, 1 the job ran and failed, 2 bad input or usage, 130 interrupted.

A module of this room is one verb: `add_verb` declares its arguments, `run` does the job. What is heavy is imported by `run`,
so that asking for help loads nothing.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from drake_aerial._version import __version__
from drake_aerial.cli import defaults, demo, demonstrate, fly, learn, report, study, transfer, view
from drake_aerial.cli.interrupts import interruptible
from drake_aerial.errors import InputError, JobError

# In the order in which the help names them.
VERBS = (demo, learn, transfer, demonstrate, fly, study, report, view, defaults)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit code."""
    arguments = _parser().parse_args(argv)
    try:
        with interruptible():
            return arguments.run(arguments)
    except InputError as error:
        print(f"drake-aerial {arguments.verb}: {_one_line(error)}", file=sys.stderr)
        return 2
    except JobError as error:
        print(f"drake-aerial {arguments.verb}: {_one_line(error)}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print(
            f"drake-aerial {arguments.verb}: interrupted; nothing was half-written", file=sys.stderr
        )
        return 130
    except BrokenPipeError:
        # The reader of our stdout left; Python would complain once more when it flushes.
        sys.stderr.close()
        return 1
    except OSError as error:
        # The machine's, not the package's: a full disk, no permission, too many open files.
        where = f" {error.filename}" if error.filename else ""
        print(
            f"drake-aerial {arguments.verb}: {_one_line(error.strerror or error)}{where}",
            file=sys.stderr,
        )
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="drake-aerial",
        description="Learn where grippers belong from one demonstration, transfer it to an unknown payload, fly it in Drake.",
    )
    parser.add_argument("--version", action="version", version=f"drake-aerial {__version__}")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for verb in VERBS:
        verb.add_verb(verbs)
    return parser


def _one_line(error: object) -> str:
    """Return an error's message without line breaks and control characters, cut short in the middle where it is endless."""
    text = "".join(c if c.isprintable() else " " for c in " ".join(str(error).split()))
    return text if len(text) <= 1000 else f"{text[:600]} ... {text[-300:]}"
