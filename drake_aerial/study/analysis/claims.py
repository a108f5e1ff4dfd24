"""The paper's claims, each with our figure, its interval, and a verdict by a rule that is stated beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from drake_aerial.study.analysis.quantities import BELIEF_ORDER, position

PAPER_CONDITIONS = ("A", "B", "C", "D")
OURS = ("task", "paper")
BASELINE = "kopicki"
FEWEST_SOLUTIONS = 4
"""A verdict on methods needs at least so many solutions of each: of three, no interval covers more than three quarters."""

BETTER, WORSE, UNDECIDED, NOT_TESTED = "holds", "reversed", "undecided", "not tested"


@dataclass(frozen=True)
class Finding:
    """What one condition under one belief says about a claim.

    Attributes
    ----------
    condition, belief : str
        Where; the belief is empty for claims about contacts alone.
    subject : str
        Whose: the method in question, or what is compared.
    outcome : str
        holds, reversed (the opposite is shown), undecided (the interval allows both) or not tested.
    figure : tuple
        (value, low, high) in `unit`.
    unit : str
        As written, after `factor` has been applied.
    detail : str
        More figures, or why it was not tested.
    digits : int
        Behind the point.
    counted : bool
        Whether the verdict rests on it: not on conditions that the paper does not have.
    """

    condition: str
    belief: str
    subject: str
    outcome: str
    figure: tuple[float | None, float | None, float | None] = (None, None, None)
    unit: str = ""
    detail: str = ""
    digits: int = 2
    counted: bool = True

    def text(self) -> str:
        """Return the figure with its interval, as written."""
        value, low, high = self.figure
        if value is None:
            return self.detail or "–"
        text = f"{value:.{self.digits}f}"
        if low is not None and high is not None:
            text += f" [{low:.{self.digits}f}, {high:.{self.digits}f}]"
        return f"{text} {self.unit}".strip().replace("-", "−")


@dataclass(frozen=True)
class Claim:
    """One claim of the paper, as tested.

    Attributes
    ----------
    key : str
        A name for it.
    text : str
        What the paper says.
    rule : str
        How its verdict comes about, in words.
    figure : str
        What the figure is.
    findings : tuple of Finding
        One a condition, belief and subject.
    verdicts : dict
        Subject to verdict.
    why : tuple of str
        Where it does not hold: figures that show the reason.
    """

    key: str
    text: str
    rule: str
    figure: str
    findings: tuple[Finding, ...]
    verdicts: dict[str, str]
    why: tuple[str, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Return the claim as it stands in summary.json."""
        return {
            "key": self.key,
            "claim": self.text,
            "rule": self.rule,
            "figure": self.figure,
            "verdicts": self.verdicts,
            "findings": [
                {
                    "condition": f.condition,
                    "belief": f.belief,
                    "subject": f.subject,
                    "outcome": f.outcome,
                    "value": f.figure[0],
                    "low": f.figure[1],
                    "high": f.figure[2],
                    "unit": f.unit,
                    "detail": f.detail,
                    "counted": f.counted,
                }
                for f in self.findings
            ],
            "why": list(self.why),
        }


def verdict(findings: Sequence[Finding]) -> str:
    """Return the verdict over the conditions that count and over beliefs.

    Within a belief: "holds" if it holds in every condition tested, "holds in A, C only" if in some, "undecided" if
    every interval allows both, "does not hold" otherwise.
    Over beliefs: that, if all agree; "holds under belief X" if it holds in full under X alone; each belief's own otherwise.
    """
    findings = [f for f in findings if f.counted]
    words = {
        belief: _of_conditions([f for f in findings if f.belief == belief])
        for belief in sorted({f.belief for f in findings}, key=lambda b: position(BELIEF_ORDER, b))
    }
    words = {belief: word for belief, word in words.items() if word != NOT_TESTED}
    if not words:
        return NOT_TESTED
    if len(set(words.values())) == 1:
        return next(iter(words.values()))
    rest = [f"{word} under {belief}" for belief, word in words.items() if word != "holds"]
    full = [belief for belief, word in words.items() if word == "holds"]
    return "; ".join(([f"holds under belief {', '.join(full)}"] if full else []) + rest)


def _of_conditions(findings: Sequence[Finding]) -> str:
    tested = [f for f in findings if f.outcome != NOT_TESTED]
    held = [f.condition for f in tested if f.outcome == BETTER]
    if not tested:
        return NOT_TESTED
    if not held:
        return UNDECIDED if all(f.outcome == UNDECIDED for f in tested) else "does not hold"
    if len(held) == len(tested):
        return "holds"
    return f"holds in {', '.join(dict.fromkeys(held))} only"


def paper_conditions(names: Sequence[str]) -> tuple[str, ...]:
    """Return the conditions on which the paper's claims are tested: its own, or all of a study that has none of them."""
    return tuple(name for name in names if name in PAPER_CONDITIONS) or tuple(names)


def outcome_of(low: float | None, high: float | None, line: float) -> str:
    """Return what an interval says about "smaller than `line`"."""
    if low is None or high is None:
        return NOT_TESTED
    if high < line:
        return BETTER
    return WORSE if low > line else UNDECIDED
