"""Fixtures: the paper's box, suspended from its top face, and a short trajectory."""

import numpy as np
import pytest

from drake_aerial.plant.payload import Payload
from drake_aerial.references.trajectory import TransportTrajectory
from drake_aerial.simulation.suspended_payload import SuspendedPayload


@pytest.fixture
def box():
    return Payload.read("box_68x61x28")


@pytest.fixture
def hang(box):
    def make(x=0.0, y=0.0, payload=None):
        return SuspendedPayload.from_contacts(
            payload or box, np.array([[x, y, 0.14]]), [[0.0, 0.0, 1.0]]
        )

    return make


@pytest.fixture
def quick():
    """A transport of 8.5 s: lift, half a turn of a small circle, hover."""
    return TransportTrajectory(
        ground_time=1.5,
        lift_time=2.0,
        lift_height=0.5,
        approach_time=1.0,
        approach=(0.12, 0.0, 0.0),  # at most 1.1 m/s^2 on the way
        radius=0.3,
        turns=0.5,
        circle_time=3.0,
        hover_time=1.0,
    )
