import json

import pytest
import yaml

from drake_aerial import InputError, StudyPlan
from drake_aerial.study.conditions import Condition


def write(path, text):
    path.write_text(text)
    return path


def test_the_built_in_plan_is_the_published_study():
    plan = StudyPlan.read("paper")
    arms = {(a.condition.name, a.method, a.belief, a.inertia): a for a in plan.arms()}
    for condition in ("A", "B", "B_centroid", "C", "D"):
        for method in ("task", "paper", "kopicki"):
            published = arms[condition, method, "below_contact", "table"]
            assert (published.solutions, published.trials) == (5, 10)
            assert arms[condition, method, "true", "table"].trials == 3
            assert arms[condition, method, "below_contact", "mesh"].trials == 3
    assert {a.condition.name for a in plan.arms()} == {
        "A",
        "A_full",
        "B",
        "B_centroid",
        "C",
        "D",
        "E",
        "F",
        "G",
        "H",
    }
    # 5 conditions x 3 methods x 5 x 10; centroid; A_full, E to G; belief true; inertia mesh; H.
    assert plan.count == 750 + 15 + 4 * 48 + 2 * 5 * 48 + 18
    quick = plan.chosen(solutions=1, trials=1)
    assert quick.count == 15 + 5 + 16 + 2 * 20 + 6
    assert len(quick.arms()) == len(plan.arms())


def test_a_plan_written_is_the_plan_read(tmp_path):
    plan = StudyPlan.read("paper").chosen(conditions=["A", "F", "H"], trials=2, seed=9)
    path = write(
        tmp_path / "study.yaml",
        yaml.safe_dump(json.loads(json.dumps(plan.to_dict())), sort_keys=False),
    )
    again = StudyPlan.read(path)
    assert again.to_dict() == plan.to_dict()
    assert again == plan


def test_choices_keep_order_and_merge_parts(tiny):
    assert [(a.condition.name, a.method, a.belief, a.solutions, a.trials) for a in tiny.arms()] == [
        ("A", "task", "below_contact", 2, 2),
        ("A", "centroid", "below_contact", 2, 2),
        ("A", "task", "true", 1, 1),
        ("H", "corner", "true", 1, 1),
    ]
    assert [a.method for a in tiny.chosen(methods=["centroid"]).arms()] == ["centroid", "corner"]
    assert [a.belief for a in tiny.chosen(beliefs=["true"], conditions=["A"]).arms()] == ["true"]
    assert tiny.chosen(solutions=4, trials=5).arms()[2].solutions == 4
    with pytest.raises(InputError, match="no flights with all of these"):
        tiny.chosen(conditions=["A"], methods=["centroid"], beliefs=["true"])


def test_an_arm_of_two_parts_is_flown_once_as_often_as_the_larger_asks(tmp_path, tiny_file):
    text = (
        tiny_file.read_text() + "  - {conditions: [A], methods: [task], solutions: 1, trials: 7}\n"
    )
    arms = [
        a for a in StudyPlan.read(write(tmp_path / "p.yaml", text)).arms() if a.method == "task"
    ]
    assert [(a.belief, a.solutions, a.trials) for a in arms] == [
        ("below_contact", 2, 7),
        ("true", 1, 1),
    ]


GOOD = """conditions:
  - {name: A, demonstration: flat, payload: box_68x61x28}
flights:
  - {conditions: [A], methods: [task]}
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("conditions:\n", "condition:\n", ["condition", "conditions"]),
        ("payload: box", "payloadd: box", ["payloadd", "payload"]),
        ("box_68x61x28", "box_68x61x29", ["box_68x61x29", "box_68x61x28"]),
        ("flat", "flatt", ["flatt", "edge"]),
        ("name: A", "name: A/B", ["A/B"]),
        ("name: A", "name: A, view: topp", ["topp", "'top'"]),
        ("name: A", "name: A, view: partial", ["viewpoint"]),
        ("name: A", "name: A, controller: mcp", ["mcp", "'mpc'"]),
        ("name: A", "name: A, cable: rope", ["rope", "elastic"]),
        ("name: A", "name: A, scan_noise: -1", ["scan_noise"]),
        ("name: A", "name: A, points: 3", ["points"]),
        ("name: A", "name: A, trajectory: {kind: transport, radios: 2}", ["radios", "radius"]),
        ("name: A", "name: A, trajectory: loop", ["loop", "transport"]),
        ("name: A", "name: A, contacts: {x: [[0, 0, 0]]}", ["contacts"]),
        ("[task]", "[tusk]", ["tusk", "task"]),
        ("[task]", "[]", ["methods"]),
        ("[task]", "[task], trials: 0", ["trials"]),
        ("[task]", "[task], beliefs: [truth]", ["truth", "true"]),
        ("[task]", "[task], inertias: [own]", ["own", "mesh"]),
        ("[task]", "[task, task]", ["twice"]),
        ("{conditions: [A]", "{conditions: [B]", ["B", "A"]),
    ],
)
def test_bad_plans_are_refused_in_one_line(tmp_path, old, new, words):
    assert old in GOOD
    with pytest.raises(InputError) as refused:
        StudyPlan.read(write(tmp_path / "bad.yaml", GOOD.replace(old, new, 1)))
    for word in words:
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)


def test_files_may_lie_beside_the_plan(tmp_path):
    write(tmp_path / "mine.yaml", "box: [0.4, 0.3, 0.2]\nmass: 0.2\n")
    plan = StudyPlan.read(write(tmp_path / "p.yaml", GOOD.replace("box_68x61x28", "mine.yaml")))
    assert plan.conditions[0].payload_with("file").mass == 0.2
    before = plan.conditions[0].fingerprint()
    write(tmp_path / "mine.yaml", "box: [0.4, 0.3, 0.2]\nmass: 0.21\n")
    assert plan.conditions[0].fingerprint() != before


def test_inertias():
    condition = Condition("A", "bunny", demonstration="flat")
    table, mesh = condition.payload_with("table"), condition.payload_with("mesh")
    assert table.inertia.diagonal() == pytest.approx([0.006, 0.0059, 0.0107])
    # A bunny of 0.25 kg, half a metre tall: between a rod's and a shell's, and not the table's.
    assert 0.001 < mesh.inertia[0, 0] < 0.006
    assert (table.com == mesh.com).all()
    assert table.mass == mesh.mass == 0.25
