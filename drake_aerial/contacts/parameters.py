"""Parameters of a transfer, and the names of the methods (docs/method.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_aerial.errors import InputError
from drake_aerial.statics.lift import Lift

SCALES = ("auto", "support", "area", "rigid")


@dataclass(frozen=True)
class TransferParameters:
    """Parameters of `transfer`.

    Attributes
    ----------
    scale : str
        How demonstrated offsets scale in the votes: `support` of the hulls per direction, square root of
        their `area`, `rigid`, or `auto`, which chooses by the scan.
    voters : int
        Salient features of the new cloud that vote.
    vote_sigma : float
        Bandwidth of the votes' position [m].
    vote_sigma_rotation : float
        Bandwidth of the votes' rotation, or of their yaw for several grippers [rad].
    vote_descriptor, vote_depth : float
        Standard deviations of the differences in saliency and in relative depth that a vote tolerates; for several
        grippers the latter also in the relative place along the edge.
    vote_aspect : float
        Standard deviation of the log of the ratio between an object's stretch along and across a vote's direction.
    candidates : int
        Candidate gripper poses per gripper under `normalised` sampling.
    floor : float
        d0 of the contact density, as a part of the median sampling density.
    paper_candidates, paper_votes, kernels : int
        The sampling of the paper's query density: candidates, votes and N_Q.
    paper_scale : bool
        Whether the paper's votes are scaled with the object's size.
    starts, chains, steps : int
        Annealing: chains at the start, chains kept after a tenth of the steps, steps.
    step_position, step_rotation : float
        Standard deviations of the first annealing steps [m], [rad].
    temperature : (float, float)
        First and last temperature, in units of log J.
    distinct : float
        Solutions whose grippers all lie nearer than this to another's are the same [m].
    min_elevation : float
        A gripper axis lower than this above the horizontal is "upside down" [rad].
    clearance : float
        A cable that comes nearer than this to the surface passes through it [m].
    off_surface : float
        A contact further than this from the surface is off it [m].
    separation : float
        Least distance between two quadrotors [m].
    lift : Lift or None
        What is known of the payload's weight and the quadrotors' thrust; None: no cable is judged by its tension.
    """

    scale: str = "auto"
    voters: int = 1000
    vote_sigma: float = 0.05
    vote_sigma_rotation: float = float(np.deg2rad(20.0))
    vote_descriptor: float = 0.2
    vote_depth: float = 0.15
    vote_aspect: float = 0.3
    candidates: int = 5000
    floor: float = 0.1
    paper_candidates: int = 10_000
    paper_votes: int = 20_000
    kernels: int = 1000
    paper_scale: bool = False
    starts: int = 400
    chains: int = 100
    steps: int = 500
    step_position: float = 0.01
    step_rotation: float = float(np.deg2rad(5.0))
    temperature: tuple[float, float] = (1.0, 0.01)
    distinct: float = 0.005
    min_elevation: float = float(np.deg2rad(10.0))
    clearance: float = 0.005
    off_surface: float = 0.01
    separation: float = 0.35
    lift: Lift | None = None

    def __post_init__(self) -> None:
        if self.scale not in SCALES:
            raise InputError(f"scale should be one of {', '.join(SCALES)}, got {self.scale!r}")
        for name in (
            "voters",
            "candidates",
            "paper_candidates",
            "paper_votes",
            "kernels",
            "starts",
            "chains",
            "steps",
        ):
            if getattr(self, name) < 1:
                raise InputError(f"{name} should be at least 1, got {getattr(self, name)}")
        for name in ("vote_sigma", "vote_sigma_rotation", "vote_descriptor", "vote_depth", "floor"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"{name} should be positive, got {getattr(self, name)}")
        first, last = self.temperature
        if not (first >= last > 0.0):
            raise InputError(f"temperature should fall and stay positive, got {self.temperature}")
