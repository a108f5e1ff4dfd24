"""The fitted model that turns evidence into a probability; its data are in trust_model.json.

The log-odds are a sum of weighted terms, each a fixed function of one or two statistics. A
monotonous line through a few points corrects them, so that answers with 80 % are right in 80 % of
the generated cases. `tools/fit_trust.py` fits both and writes where the data come from.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from drake_aerial.contacts.trust.evidence import Evidence
from drake_aerial.geometry import Array

# Distances of this share of the size count as none.
_NONE, _NONE_BOX = 0.003, 0.01


def terms_of(evidence: Evidence) -> dict[str, float]:
    """Return the terms of the log-odds by name, before their weights."""
    e = evidence
    box = np.log(e.box_distance + _NONE_BOX)
    return {
        "whole": np.log(e.whole + _NONE),
        "near": np.log(e.near + _NONE),
        "unexplained": np.log(e.unexplained + _NONE),
        "box_fit": np.log(e.box_fit + _NONE),
        "better_elsewhere": e.better_elsewhere,
        "counterparts": e.counterparts,
        "box_distance": box,
        "box_nearest": np.log(e.box_nearest + _NONE_BOX),
        "height": abs(e.height),
        "above": abs(e.above),
        "proportions": min(abs(e.proportions), 2.0),
        "fill": abs(e.fill),
        "gap": e.gap,
        "gap_distance": e.gap_distance,
        "cut": e.cut,
        "cut_box": e.cut * box,
        "size_ratio": min(e.size_ratio, 2.0),
    }


@dataclass(frozen=True, eq=False)
class TrustModel:
    """Weights of the terms, and the correction of the log-odds.

    Attributes
    ----------
    intercept : float
        Log-odds without terms.
    weights : mapping of str to float
        Weight of each term of `terms_of`.
    log_odds, probability : (P,) arrays
        Points of the correction, both increasing.
    provenance : mapping
        Script, commit, seeds and numbers of cases that the model was fitted on.
    """

    intercept: float
    weights: Mapping[str, float]
    log_odds: Array
    probability: Array
    provenance: Mapping[str, Any]

    @classmethod
    def shipped(cls) -> TrustModel:
        """Return the model that comes with the package."""
        return _shipped()

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> TrustModel:
        """Return the model of a data file's content."""
        return cls(
            intercept=float(values["intercept"]),
            weights={name: float(weight) for name, weight in values["weights"].items()},
            log_odds=np.array(values["log_odds"], float),
            probability=np.array(values["probability"], float),
            provenance=values["provenance"],
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the content of the data file."""
        return {
            "intercept": self.intercept,
            "weights": dict(self.weights),
            "log_odds": self.log_odds.tolist(),
            "probability": self.probability.tolist(),
            "provenance": dict(self.provenance),
        }

    def probability_of(self, evidence: Evidence) -> float:
        """Return the probability that the solution is right."""
        terms = terms_of(evidence)
        log_odds = self.intercept + sum(w * terms[name] for name, w in self.weights.items())
        return float(np.interp(log_odds, self.log_odds, self.probability))


@cache
def _shipped() -> TrustModel:
    text = files("drake_aerial.contacts.trust").joinpath("trust_model.json").read_text("utf-8")
    return TrustModel.from_dict(json.loads(text))
