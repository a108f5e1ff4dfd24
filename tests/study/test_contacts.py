import numpy as np
import pytest

from drake_aerial import InputError
from drake_aerial.contacts.feasibility.reasons import Reason, ReasonKind
from drake_aerial.contacts.solutions import Solution
from drake_aerial.geometry import Pose
from drake_aerial.plant.payload import Payload
from drake_aerial.study.conditions import Condition
from drake_aerial.study.contacts import ContactTask, find_contacts, place

BOX = Payload.read("box_68x61x28")
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def solution(*positions, reasons=()):
    p = np.array(positions, float)
    n = len(p)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    return Solution(
        2,
        -3.0,
        not reasons,
        tuple(map(Reason.from_text, reasons)),
        Pose(p, np.tile(LEVEL, (n, 1))),
        up,
        Pose(p + 0.5 * up, np.tile(LEVEL, (n, 1))),
    )


def test_what_touches_stays_where_it_is():
    found = solution([0.1, 0.0, 0.145], [0.0, 0.2, 0.14])
    placed = place(found, BOX)
    assert placed.solution is found
    assert placed.moved.tolist() == [0.0, 0.0]
    assert placed.obstacles == ()


def test_what_touches_nothing_moves_to_the_closest_point_and_says_so():
    reasons = ("gripper 2: off the surface (nearest point 9.0 cm away)",)
    placed = place(solution([0.1, 0.0, 0.14], [0.30, 0.30, 0.23], reasons=reasons), BOX)
    assert placed.moved == pytest.approx([0.0, 0.09])
    assert placed.solution.X_SG.p[1] == pytest.approx([0.30, 0.30, 0.14])
    assert placed.solution.X_SQ.p[1] == pytest.approx([0.30, 0.30, 0.64])
    assert placed.obstacles == ()
    # The transfer's own verdict stays what it was.
    assert not placed.solution.feasible
    assert tuple(map(str, placed.solution.reasons)) == reasons


def test_a_gripper_in_the_air_moves_whether_the_scan_showed_it_or_not():
    placed = place(solution([0.0, 0.0, 0.17]), BOX)
    assert placed.moved == pytest.approx([0.03])


def test_moving_to_the_underside_is_no_cure():
    placed = place(
        solution([0.0, 0.0, -0.2], reasons=("off the surface (nearest point 6.0 cm away)",)), BOX
    )
    assert placed.moved == pytest.approx([0.06])
    assert len(placed.obstacles) == 1
    assert placed.obstacles[0].kind is ReasonKind.UPSIDE_DOWN_AFTER_MOVE


def test_other_reasons_remain():
    placed = place(solution([0.0, 0.0, 0.14], reasons=("cable through the payload",)), BOX)
    assert placed.obstacles == (Reason(ReasonKind.CABLE_THROUGH_PAYLOAD),)


def test_given_contacts_are_set_on_the_surface():
    condition = Condition(
        "H", "box_68x61x28", contacts=(("corner", ((0.3, 0.25, 0.2),)),), points=2000
    )
    found = find_contacts(ContactTask(condition, "corner", 0, 1))
    assert found.failure is None
    assert found.contacts.method == "corner"
    assert found.contacts[0].X_SG.p == pytest.approx(np.array([[0.3, 0.25, 0.14]]))
    assert found.contacts[0].normal == pytest.approx(np.array([[0.0, 0.0, 1.0]]))


def test_a_transfer_that_finds_nothing_is_no_defect(monkeypatch):
    from drake_aerial import JobError
    from drake_aerial.contacts import transfer as module

    def nothing(*arguments, **keywords):
        raise JobError("the votes are zero\neverywhere")

    monkeypatch.setattr(module, "transfer", nothing)
    found = find_contacts(
        ContactTask(
            Condition("A", "box_68x61x28", demonstration="flat", points=2000), "paper", 0, 5
        )
    )
    assert found.contacts is None
    assert found.failure == "the votes are zero everywhere"


def test_workers_of_another_version_refuse():
    with pytest.raises(InputError, match=r"0\.0\.1"):
        find_contacts(
            ContactTask(
                Condition("A", "box_68x61x28", demonstration="flat"), "task", 0, 5, version="0.0.1"
            )
        )
