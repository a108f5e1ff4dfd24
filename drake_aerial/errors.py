"""The package's exceptions. Each has a message of one line.

The command line maps `InputError` to exit code 2 and `JobError` to exit code 1.
"""


class DrakeAerialError(Exception):
    """Base class of the package's own errors."""


class InputError(DrakeAerialError, ValueError):
    """Invalid input: the message names the given and the accepted values."""


class JobError(DrakeAerialError, RuntimeError):
    """The input was valid but the job failed, for instance because no contact is feasible."""


def one_line(message: object) -> str:
    """Return a message without line breaks and control characters, long ones shortened."""
    text = "".join(c if c.isprintable() else " " for c in " ".join(str(message).split()))
    return text if len(text) <= 1000 else f"{text[:600]} ... {text[-300:]}"
