"""contacts.json: its keys, reading it back, and files that are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from drake_aerial.contacts.parameters import TransferParameters
from drake_aerial.contacts.solutions import ContactSolutions, Solution
from drake_aerial.errors import InputError
from drake_aerial.geometry import Pose
from drake_aerial.statics.lift import Lift

KEYS = [
    "schema",
    "version",
    "units",
    "frame",
    "method",
    "seed",
    "skill",
    "cloud",
    "timing",
    "solutions",
]


def make():
    up = np.array([[1.0, 0.0, 0.0, 0.0]])
    solutions = tuple(
        Solution(
            rank,
            -float(rank) / 3.0,
            rank == 2,
            () if rank == 2 else ("upside down",),
            Pose(np.array([[0.1 * rank, 1 / 3, 0.3]]), up),
            np.array([[0.0, 0.0, 1.0]]),
            Pose(np.array([[0.1, 0.2, 0.8]]), up),
        )
        for rank in (1, 2)
    )
    cloud = {
        "path": None,
        "sha256": "ab",
        "points": 7,
        "dropped_points": 1,
        "centroid": [0.0, 0.0, 0.0],
    }
    timing = {"features_s": 0.1, "query_s": 0.2, "optimise_s": 0.3}
    return ContactSolutions("task", 3, "flat", cloud, timing, solutions)


def test_holds_the_contract():
    values = json.loads(make().to_json())
    assert list(values) == KEYS
    assert (values["schema"], values["version"]) == ("drake_aerial/contacts", 1)
    assert (values["units"], values["frame"]) == ("m", "cloud")
    assert set(values["cloud"]) == {"path", "sha256", "points", "dropped_points", "centroid"}
    assert set(values["timing"]) == {"features_s", "query_s", "optimise_s"}
    solution = values["solutions"][0]
    assert set(solution) == {
        "rank",
        "log_likelihood",
        "feasible",
        "reasons",
        "grippers",
        "quadrotors",
    }
    assert set(solution["grippers"][0]) == {"position", "quaternion_wxyz", "normal"}
    assert set(solution["quadrotors"][0]) == {"position", "quaternion_wxyz"}
    assert solution["reasons"] == ["upside down"]


def test_reads_back_bit_equal(tmp_path):
    make().write(tmp_path / "contacts.json")
    again = ContactSolutions.read(tmp_path / "contacts.json")
    assert again.to_json() == make().to_json()
    np.testing.assert_array_equal(again[0].X_SG.p, make()[0].X_SG.p)
    assert again.best is not None
    assert again.best.rank == 2
    assert [path.name for path in tmp_path.iterdir()] == ["contacts.json"]


def test_keeps_the_parameters_it_was_found_with(tmp_path):
    parameters = TransferParameters(
        scale="rigid", vote_sigma=1 / 3, lift=Lift(0.5, (7.0,), (0.25,))
    )
    found = replace(make(), parameters=parameters)
    assert list(found.to_dict()) == [*KEYS, "parameters"]
    found.write(tmp_path / "contacts.json")
    again = ContactSolutions.read(tmp_path / "contacts.json")
    assert again.parameters == parameters
    assert again.to_json() == found.to_json()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": {"votes": 3}}, "parameters: unknown key 'votes'"),
        ({"parameters": 0}, "parameters: must be a mapping"),
        ({"schema": "x"}, "`schema` must be .*, got 'x'"),
        ({"version": 2}, "`version` must be 1, got 2"),
        ({"solutions": [{"rank": 1}]}, "incomplete"),
        ({"skill": None, "seed": None}, "incomplete"),
    ],
)
def test_refuses_other_files(tmp_path, change, message):
    path = tmp_path / "contacts.json"
    path.write_text(json.dumps(make().to_dict() | change))
    with pytest.raises(InputError, match=message):
        ContactSolutions.read(path)


def test_refuses_what_is_no_json(tmp_path):
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(InputError, match="not JSON"):
        ContactSolutions.read(tmp_path / "a.json")
    with pytest.raises(InputError, match="cannot read"):
        ContactSolutions.read(tmp_path / "missing.json")
