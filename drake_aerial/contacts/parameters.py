"""Parameters of a transfer; docs/method.md explains the defaults."""

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from drake_aerial.errors import InputError
from drake_aerial.io.records import Count, Flag, NonNegative, Number, Positive, record
from drake_aerial.statics.lift import Lift

Scale = Literal["auto", "support", "area", "rigid"]


@record(frozen=True)
class TransferParameters:
    """Parameters of `transfer`.

    Examples
    --------
    >>> from drake_aerial import TransferParameters, read_scan, read_skill, transfer
    >>> quick = TransferParameters(candidates=500, starts=50, chains=10, steps=50)
    >>> contacts = transfer(read_skill("flat"), read_scan("box_68x68x28"), parameters=quick)
    >>> contacts.parameters.candidates
    500
    """

    scale: Scale = "auto"
    """How demonstrated offsets scale in the votes: support (of the hulls, per direction), area (its
    square root), rigid (not at all) or auto (chosen by the scan)."""
    voters: Count = 1000
    """Salient features of the new cloud that vote."""
    vote_sigma: Positive = 0.05
    """Bandwidth of the votes' position [m]."""
    vote_sigma_rotation: Positive = float(np.deg2rad(20.0))
    """Bandwidth of the votes' rotation, or of their yaw for several grippers [rad]."""
    vote_descriptor: Positive = 0.2
    """Standard deviation of the difference in saliency that a vote tolerates (dimensionless)."""
    vote_depth: Positive = 0.15
    """Standard deviation of the difference in relative depth that a vote tolerates, and for several
    grippers in the relative place along the edge (dimensionless)."""
    vote_aspect: Positive = 0.3
    """Standard deviation of the logarithm of an object's stretch along over its stretch across a
    vote's direction (dimensionless)."""
    candidates: Count = 5000
    """Candidate poses per gripper, in the method task."""
    floor: Positive = 0.1
    """Density d0 that is added to the contact density, as a fraction of the median sampling density
    (dimensionless)."""
    paper_candidates: Count = 10_000
    """Candidate poses per gripper, in the methods kopicki and paper."""
    paper_votes: Count = 20_000
    """Votes in the method paper."""
    kernels: Count = 1000
    """Kernels of the query density in the methods kopicki and paper, N_Q in the paper."""
    paper_scale: Flag = False
    """True to scale the votes of the method paper with the object's size."""
    starts: Count = 400
    """Annealing chains at the start."""
    chains: Count = 100
    """Annealing chains kept after a tenth of the steps."""
    steps: Count = 500
    """Annealing steps of each chain."""
    step_position: NonNegative = 0.01
    """Standard deviation of the first annealing steps in position [m]."""
    step_rotation: NonNegative = float(np.deg2rad(5.0))
    """Standard deviation of the first annealing steps in rotation [rad]."""
    temperature: tuple[Positive, Positive] = (1.0, 0.01)
    """First and last annealing temperature, in units of log J (dimensionless); the last is not
    above the first."""
    distinct: NonNegative = 0.005
    """Distance below which two solutions are the same, if it holds for all grippers [m]."""
    min_elevation: Annotated[Number, Ge(-np.pi / 2), Le(np.pi / 2)] = float(np.deg2rad(10.0))
    """Elevation of a gripper's axis above the horizontal below which it counts as upside down
    [rad]."""
    clearance: NonNegative = 0.005
    """Distance from the surface below which a cable counts as passing through it [m]."""
    off_surface: NonNegative = 0.01
    """Distance from the surface above which a contact counts as off the surface [m]."""
    separation: NonNegative = 0.35
    """Smallest distance between two quadrotors [m]."""
    min_trust: Annotated[NonNegative, Le(1)] = 0.5
    """Trust of the best solution below which the command `transfer` fails, a probability
    (dimensionless)."""
    lift: Lift | None = None
    """Masses and thrust limits; None for no check of cable tensions."""

    def __post_init__(self) -> None:
        first, last = self.temperature
        if last > first:
            raise InputError(
                f"`temperature` must be [first, last] with last <= first, got {[first, last]}"
            )
