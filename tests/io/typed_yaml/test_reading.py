import re

import pytest

from drake_aerial.errors import InputError
from drake_aerial.io.typed_yaml.reading import read_record, record_from_mapping
from tests.io.typed_yaml.boats import Boat, Motor, Raft, Sail


def read(values, cls=Boat):
    return record_from_mapping(cls, values, "boat")


def test_what_is_left_out_has_its_default():
    assert read({}) == Boat()
    assert read({"length": 8, "sail": {"area": 15}}) == Boat(length=8.0, sail=Sail(15.0))
    assert isinstance(read({"length": 8}).length, float)
    assert read({"motor": {"power": 4e3, "fuel": "diesel"}}).motor == Motor(4000.0, "diesel")
    assert read({"sail": [{}, {"area": 3}]}).sail == (Sail(), Sail(3.0))


def test_numbers_without_a_point_are_numbers():
    """YAML 1.1 reads 5e3 as a text."""
    assert read({"length": "5e3"}).length == 5000.0
    assert read({"endurance": "inf"}).endurance == float("inf")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"lenght": 8},
            "boat: unknown key 'lenght' (did you mean 'length'?); accepted: kind, length, ",
        ),
        ({"length": "long"}, "boat: length should be a finite number, got 'long'"),
        ({"length": True}, "boat: length should be a finite number, got True"),
        ({"length": float("inf")}, "boat: length should be a finite number, got inf"),
        ({"length": None}, "boat: length should be a finite number, got None"),
        ({"endurance": float("nan")}, "boat: endurance should be a number, got nan"),
        ({"length": -1}, "boat: the boat's length is -1.0 m; a positive number accepted"),
        ({"hull": [1, 2]}, "boat: hull should be a list of 3, got [1, 2]"),
        ({"hull": [1, 2, "x"]}, "boat: hull, entry 3 should be a finite number, got 'x'"),
        ({"hull": 1}, "boat: hull should be a list of 3, got 1"),
        ({"depths": []}, "boat: depths should be a list, got []"),
        ({"depths": [1, 2.5]}, "boat: depths, entry 2 should be a whole number, got 2.5"),
        ({"depths": [True]}, "boat: depths, entry 1 should be a whole number, got True"),
        ({"wooden": "no"}, "boat: wooden should be true or false, got 'no'"),
        ({"name": 3}, "boat: name should be a text, got 3"),
        (
            {"kind": "slop"},
            "boat: kind should be sloop or yawl, got 'slop' (did you mean 'sloop'?)",
        ),
        (
            {"sail": {"aera": 1}},
            "boat: sail: unknown key 'aera' (did you mean 'area'?); accepted: area, sheets, reefs",
        ),
        (
            {"sail": [{}, 3]},
            "boat: sail, entry 2 should be a mapping with area, sheets, reefs, got 3",
        ),
        (
            {"spare": "large"},
            "boat: spare should be a mapping with area, sheets, reefs, got 'large'",
        ),
        (
            {"motor": {"power": 4000}},
            "boat: motor: the key 'fuel' is missing; accepted: power, fuel",
        ),
        ([1], "boat should be a mapping with kind, length, "),
    ],
)
def test_what_does_not_fit_is_refused_with_what_was_given_and_what_is_accepted(values, message):
    with pytest.raises(InputError, match="^" + re.escape(message)):
        read(values)


def test_unions_are_told_apart_by_kind():
    assert read({"kind": "raft", "logs": 5}, Boat | Raft) == Raft(logs=5)
    assert read({"kind": "yawl"}, Boat | Raft) == Boat(kind="yawl")
    with pytest.raises(InputError, match=r"unknown key 'logs'"):
        read({"kind": "yawl", "logs": 5}, Boat | Raft)
    for values in ({}, {"kind": "rafd"}, {"kind": [1]}, 7):
        with pytest.raises(InputError, match=r"a mapping with a kind, one of sloop, yawl, raft"):
            read(values, Boat | Raft)


def test_a_record_may_be_a_file_beside_its_own(tmp_path):
    (tmp_path / "sails").mkdir()
    (tmp_path / "sails" / "big.yaml").write_text("area: 30")
    (tmp_path / "boat.yaml").write_text(
        "{sail: [sails/big.yaml, {area: 2}], spare: sails/big.yaml}"
    )
    assert read_record(Boat, tmp_path / "boat.yaml") == Boat(
        sail=(Sail(30.0), Sail(2.0)), spare=Sail(30.0)
    )
    (tmp_path / "sails" / "big.yaml").write_text("aera: 30")
    with pytest.raises(InputError, match=r"big\.yaml: unknown key 'aera'"):
        read_record(Boat, tmp_path / "boat.yaml")
    (tmp_path / "boat.yaml").write_text("spare: small.yaml")
    with pytest.raises(InputError, match=r"cannot read .*small\.yaml"):
        read_record(Boat, tmp_path / "boat.yaml")
