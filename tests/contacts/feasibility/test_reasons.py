"""Reasons as values: their texts are those of contacts.json, and are read as the same kinds."""

import dataclasses

import pytest

from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind

# Texts in contacts.json files of the first version, with the reasons that they stand for.
TEXTS = {
    "upside down (its axis points -12 deg above the horizontal)": (ReasonKind.UPSIDE_DOWN, None),
    "sideways (its axis points 3 deg above the horizontal, at least 10 deg are needed)": (
        ReasonKind.SIDEWAYS,
        None,
    ),
    "gripper 2: upside down where it was moved to (the surface faces -90 deg)": (
        ReasonKind.UPSIDE_DOWN_AFTER_MOVE,
        1,
    ),
    "gripper 3: cable through the payload": (ReasonKind.CABLE_THROUGH_PAYLOAD, 2),
    "off the surface (nearest point 5.0 cm away)": (ReasonKind.OFF_SURFACE, None),
    "gripper 12: off the surface (nearest point 13.7 cm away)": (ReasonKind.OFF_SURFACE, 11),
    "gripper 1: tilted against the surface (21 deg)": (ReasonKind.TILTED, 0),
    "quadrotors 1 and 3 too close (0.20 m, at least 0.35 m)": (
        ReasonKind.QUADROTORS_TOO_CLOSE,
        None,
    ),
    "no positive-tension equilibrium (all contacts on one side of the centre of mass)": (
        ReasonKind.ONE_SIDED,
        None,
    ),
    "no positive-tension equilibrium (cables do not balance)": (ReasonKind.UNBALANCED, None),
    "gripper 2: more tension than the propellers lift (9.8 N, at most 4.5 N)": (
        ReasonKind.TOO_MUCH_TENSION,
        1,
    ),
    'constraint "keep to (the) left" is violated by 1.2e-05': (
        ReasonKind.CONSTRAINT_VIOLATED,
        None,
    ),
}


@pytest.mark.parametrize("text", TEXTS)
def test_the_text_of_every_kind_is_read_back(text):
    reason = Reason.from_text(text)
    assert (reason.kind, reason.gripper) == TEXTS[text]
    assert str(reason) == text


def test_every_kind_has_a_text_in_this_test():
    assert {kind for kind, _ in TEXTS.values()} == set(ReasonKind) - {ReasonKind.OTHER}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "gripper 2: off the surface",
        "off the surface (nearest point 1.2.3 cm away)",
        "off the surface (nearest point nan cm away)",
        "off the surface (nearest point 1e999 cm away)",
        "gripper 02: cable through the payload",
        "an unknown reason\nin two lines",
    ],
)
def test_other_texts_are_kept_as_they_are(text):
    reason = Reason.from_text(text)
    assert reason.kind is ReasonKind.OTHER
    assert str(reason) == text


def test_values_are_in_si_units_whatever_the_text_shows():
    tilted = Reason.from_text("tilted against the surface (90 deg)")
    assert tilted.value == pytest.approx(1.5708, abs=1e-4)
    assert Reason.from_text("off the surface (nearest point 3.0 cm away)").value == 0.03
    close = Reason.from_text("quadrotors 1 and 3 too close (0.20 m, at least 0.35 m)")
    assert (close.pair, close.value, close.limit) == ((0, 2), 0.2, 0.35)


def test_reading_a_text_gives_the_reason_but_for_rounding():
    reason = Reason(ReasonKind.TOO_MUCH_TENSION, gripper=1, value=9.8123, limit=4.5377)
    rounded = dataclasses.replace(reason, value=9.8, limit=4.5)
    assert Reason.from_text(str(reason)) == rounded
