"""The package's exceptions. Each has a message of one line.

The command line maps `InputError` to exit code 2 and `JobError` to exit code 1.
"""


class DrakeAerialError(Exception):
    """Base of every error that this package raises on purpose."""


class InputError(DrakeAerialError, ValueError):
    """Bad input: the message names what was given and what is accepted."""


class JobError(DrakeAerialError, RuntimeError):
    """The input was good but the job failed, for instance because no contact is feasible."""


def one_line(message: object) -> str:
    """Return a message without line breaks and control characters, long ones shortened."""
    text = "".join(c if c.isprintable() else " " for c in " ".join(str(message).split()))
    return text if len(text) <= 1000 else f"{text[:600]} ... {text[-300:]}"
