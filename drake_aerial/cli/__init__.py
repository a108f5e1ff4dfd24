"""Command line: each command reads its arguments and calls one public function.

Results go to files. stdout carries a short summary, or one line of JSON with ``--json``; errors and
progress go to stderr. Exit codes: 0 done, 1 the job failed, 2 bad input or usage, 130 interrupted.

Each module named after a command declares its arguments in `add_command` and does the job in `run`.
`run` does the slow imports, so that help is fast. To add a command, write its module and list it in
`COMMANDS`.
"""

import argparse
import sys
from collections.abc import Sequence

from drake_aerial._version import __version__
from drake_aerial.cli import (
    defaults,
    demo,
    demonstrate,
    fly,
    identify,
    learn,
    report,
    scene,
    study,
    transfer,
    view,
)
from drake_aerial.errors import InputError, JobError, one_line

COMMANDS = (
    demo,
    learn,
    scene,
    transfer,
    demonstrate,
    fly,
    identify,
    study,
    report,
    view,
    defaults,
)
"""The commands, in the order of the help."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    name = "drake-aerial"
    try:
        arguments = _parser().parse_args(argv)
        name = f"drake-aerial {arguments.command}"
        return arguments.run(arguments)
    except InputError as error:
        code, message = 2, one_line(error)
    except JobError as error:
        code, message = 1, one_line(error)
    except KeyboardInterrupt:
        code, message = 130, "interrupted; no partial files were written"
    except BrokenPipeError:
        # The reader of stdout has left; closing stderr hides Python's own message about it.
        sys.stderr.close()
        return 1
    except OSError as error:
        # An error of the operating system: full disk, no permission, too many open files.
        where = f" {error.filename}" if error.filename else ""
        code, message = 2, one_line(f"{error.strerror or error}{where}")
    print(f"{name}: {message}", file=sys.stderr)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="drake-aerial",
        description="Learn where grippers attach from one demonstration, transfer it to a new "
        "payload, and fly the payload in Drake.",
    )
    parser.add_argument("--version", action="version", version=f"drake-aerial {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for command in COMMANDS:
        command.add_command(commands)
    return parser
