"""The command line as a process of its own: `drake-aerial`, and `python -m drake_aerial`.

Python turns Ctrl-C into an exception from its own start on, so this module imports nothing but `sys` before it can answer one.
"""

import sys


def entry_point() -> int:
    """Run the command line; Ctrl-C ends it in one line, also while the command line is still being loaded."""
    try:
        import signal

        from drake_aerial.cli import main

        code = main()
        # The job is done: Ctrl-C while Python takes itself down is not heard.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        import signal

        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stderr.write("drake-aerial: interrupted; nothing was half-written\n")
        return 130
    return code


if __name__ == "__main__":
    sys.exit(entry_point())
