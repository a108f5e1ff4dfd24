"""Claims of the paper: findings with intervals, and a verdict by a stated rule."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from drake_aerial.study.analysis.labels import BELIEF_ORDER, position

PAPER_CONDITIONS = ("A", "B", "C", "D")
OURS = ("task", "paper")
BASELINE = "kopicki"
FEWEST_SOLUTIONS = 4
"""Smallest number of solutions of each method for a verdict: intervals of three undercover."""


class Outcome(StrEnum):
    """Result of the test of a claim in one condition; "reversed" means that the opposite holds."""

    HOLDS = "holds"
    REVERSED = "reversed"
    UNDECIDED = "undecided"
    NOT_TESTED = "not tested"


@dataclass(frozen=True)
class Finding:
    """The test of a claim in one condition under one belief.

    Attributes
    ----------
    condition, belief : str
        The belief is empty for claims about contacts alone.
    subject : str
        The tested method, or the compared contacts.
    outcome : Outcome
    figure : tuple
        (value, low, high) in `unit`.
    unit : str
        Unit of the figure.
    detail : str
        Further numbers, or the reason why it was not tested.
    digits : int
        Decimal places of the figure.
    counted : bool
        Part of the verdict; False for conditions that the paper does not have.
    """

    condition: str
    belief: str
    subject: str
    outcome: Outcome
    figure: tuple[float | None, float | None, float | None] = (None, None, None)
    unit: str = ""
    detail: str = ""
    digits: int = 2
    counted: bool = True

    def text(self) -> str:
        """Return the measured value with its interval and unit."""
        value, low, high = self.figure
        if value is None:
            return self.detail or "–"
        text = self._write(value)
        if low is not None and high is not None:
            text += f" [{self._write(low)}, {self._write(high)}]"
        return f"{text} {self.unit}".strip().replace("-", "−")

    def _write(self, value: float) -> str:
        # A ratio has no upper limit if the other spread is zero in some resamples.
        return "∞" if value > 1e9 else f"{value:.{self.digits}f}"


@dataclass(frozen=True)
class Claim:
    """One claim of the paper with its test.

    Attributes
    ----------
    key : str
        Short name.
    text : str
        The paper's statement.
    rule : str
        Definition of the verdict.
    figure : str
        Definition of the findings' figure.
    findings : tuple of Finding
        One per condition, belief and subject.
    verdicts : dict
        Verdict by subject.
    why : tuple of str
        Numbers that explain findings that do not hold.
    """

    key: str
    text: str
    rule: str
    figure: str
    findings: tuple[Finding, ...]
    verdicts: dict[str, str]
    why: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the claim's entry of summary.json."""
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

    Within a belief: "holds" if it holds in every tested condition, "holds in A, C only" if in some,
    "undecided" if every interval allows both, "does not hold" otherwise. Over beliefs: the common
    verdict, or each belief's own, such as "holds under belief X".
    """
    findings = [f for f in findings if f.counted]
    words = {
        belief: _of_conditions([f for f in findings if f.belief == belief])
        for belief in sorted({f.belief for f in findings}, key=lambda b: position(BELIEF_ORDER, b))
    }
    words = {belief: word for belief, word in words.items() if word != Outcome.NOT_TESTED}
    if not words:
        return Outcome.NOT_TESTED
    if len(set(words.values())) == 1:
        return next(iter(words.values()))
    rest = [f"{word} under {belief}" for belief, word in words.items() if word != Outcome.HOLDS]
    full = [belief for belief, word in words.items() if word == Outcome.HOLDS]
    return "; ".join(([f"holds under belief {', '.join(full)}"] if full else []) + rest)


def verdicts_of_methods(findings: Sequence[Finding]) -> dict[str, str]:
    """Return the verdict for each of our methods that was tested."""
    own = {method: [f for f in findings if f.subject == method] for method in OURS}
    verdicts = {method: verdict(tested) for method, tested in own.items() if tested}
    return verdicts or {OURS[0]: Outcome.NOT_TESTED}


def _of_conditions(findings: Sequence[Finding]) -> str:
    tested = [f for f in findings if f.outcome != Outcome.NOT_TESTED]
    held = [f.condition for f in tested if f.outcome == Outcome.HOLDS]
    if not tested:
        return Outcome.NOT_TESTED
    if not held:
        return (
            Outcome.UNDECIDED
            if all(f.outcome == Outcome.UNDECIDED for f in tested)
            else "does not hold"
        )
    if len(held) == len(tested):
        return "holds"
    return f"holds in {', '.join(dict.fromkeys(held))} only"


def paper_conditions(names: Sequence[str]) -> tuple[str, ...]:
    """Return the conditions that count for verdicts: the paper's, or all if there are none."""
    return tuple(name for name in names if name in PAPER_CONDITIONS) or tuple(names)


def outcome_of(low: float | None, high: float | None, line: float) -> Outcome:
    """Return the outcome of the claim "smaller than `line`" from an interval."""
    if low is None or high is None:
        return Outcome.NOT_TESTED
    if high < line:
        return Outcome.HOLDS
    return Outcome.REVERSED if low > line else Outcome.UNDECIDED
