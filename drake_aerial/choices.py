"""Names that users choose among, for the library and the command line.

Importing this module loads nothing else, so the command line can list the names in its help.
"""

METHODS = {
    "task": ("hull", "normalised"),
    "paper": ("paper", "resampled"),
    "kopicki": ("none", "resampled"),
    "control": ("none", "normalised"),
    "centroid": ("none", "none"),
}
"""Method of `transfer` to (votes, sampling). `control` is `task` without its votes."""
BELIEFS = ("below_contact", "geometric", "true")
"""What a controller is told about the payload's centre of mass and inertia."""
CONTROLLERS = ("mpc", "geometric_ff", "geometric")
"""Kinds of controllers."""
CABLES = ("inextensible", "elastic")
"""Kinds of cables."""
