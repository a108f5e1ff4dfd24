import copy
import pickle
import re
from dataclasses import FrozenInstanceError, asdict, fields, replace

import numpy as np
import pytest

from drake_aerial.errors import InputError
from drake_aerial.io.records import is_record, range_text, read_record, record_from_mapping
from tests.io.boats import Boat, Motor, Raft, Sail


def read(values, cls=Boat):
    return record_from_mapping(cls, values, "boat.yaml")


def test_keys_that_are_left_out_have_their_defaults():
    assert read({}) == Boat()
    assert read({"length": 8, "sail": {"area": 15}}) == Boat(length=8.0, sail=Sail(15.0))
    assert isinstance(read({"length": 8}).length, float)
    assert read({"motor": {"power": 4e3, "fuel": "diesel"}}).motor == Motor(4000.0, "diesel")
    assert read({"sail": [{}, {"area": 3}]}).sail == (Sail(), Sail(3.0))
    assert read({"sign": 7}).sign == "7"
    assert read({"depths": [2.0, 3]}).depths == (2, 3)


WRONG = [
    (
        {"lenght": 8},
        "unknown key 'lenght' (did you mean 'length'?); accepted: kind, length, endurance, ",
    ),
    ({"length": "long"}, "`length` must be a number, got 'long'"),
    ({"length": "8"}, "`length` must be a number, got '8'"),
    ({"length": True}, "`length` must be a number, got True"),
    ({"length": None}, "`length` must be a number, got None"),
    ({"length": float("inf")}, "`length` must be a finite number, got inf"),
    ({"length": float("nan")}, "`length` must be a finite number, got nan"),
    ({"length": 0}, "`length` must be in (0, 100) m, got 0"),
    ({"length": 100.0}, "`length` must be in (0, 100) m, got 100.0"),
    ({"endurance": float("nan")}, "`endurance` must be > 0 h, got nan"),
    ({"hull": [1, 2]}, "`hull` must have more entries, got [1, 2]"),
    ({"hull": [1, 2, 3, 4]}, "`hull` must have at most 3 entries, got [1, 2, 3, 4]"),
    ({"hull": [1, 2, "x"]}, "`hull[2]` must be a number, got 'x'"),
    ({"hull": 1}, "`hull` must be a list, got 1"),
    ({"depths": [1, 2.5]}, "`depths[1]` must be a whole number, got 2.5"),
    ({"depths": [True]}, "`depths[0]` must be a whole number, got True"),
    ({"depths": [0]}, "`depths[0]` must be >= 1, got 0"),
    ({"depths": [{}]}, "`depths[0]` must be a whole number, got {}"),
    ({"length": 10**400}, "`length` must be a number, got 1000"),
    ({"wooden": "no"}, "`wooden` must be true or false, got 'no'"),
    ({"wooden": 1}, "`wooden` must be true or false, got 1"),
    ({"name": 3}, "`name` must be a text, got 3"),
    ({"kind": "slop"}, "`kind` must be one of sloop, yawl, got 'slop' (did you mean 'sloop'?)"),
    ({"sail": []}, "`sail` must have at least 1 entry, got []"),
    ({"sail": [{}, {"area": -1}]}, "`sail[1].area` must be > 0 m^2, got -1"),
    ({"sail": [{}, 3]}, "`sail[1]` must be a mapping of keys to values, got 3"),
    ({"spare": "large"}, "`spare` must be a mapping of keys to values, got 'large'"),
    (
        {"sail": {"aera": 1}},
        "`sail`: unknown key 'aera' (did you mean 'area'?); accepted: area, sheets, reefs",
    ),
    ({"motor": {"power": 1}}, "`motor`: the key 'fuel' is missing; accepted: power, fuel"),
    ({"draught": 9}, "`draught` must be < length = 7.5 m, got 9.0"),
    ([1], "must be a mapping of keys to values, got [1]"),
]


@pytest.mark.parametrize(("values", "message"), WRONG)
def test_a_wrong_value_in_a_file_is_refused_with_its_key_and_range(values, message):
    with pytest.raises(InputError, match="^" + re.escape(f"boat.yaml: {message}")):
        read(values)


@pytest.mark.parametrize(
    ("values", "message"),
    [w for w in WRONG if isinstance(w[0], dict) and "key" not in w[1] and w[0] != {"draught": 9}],
)
def test_a_wrong_argument_is_refused_in_the_same_words(values, message):
    with pytest.raises(InputError, match="^" + re.escape(message)):
        Boat(**values)
    with pytest.raises(InputError, match="^" + re.escape(message)):
        replace(Boat(), **values)


def test_a_mapping_in_place_of_a_record_is_checked_in_the_constructor_too():
    assert Boat(spare={"area": 3}).spare == Sail(3.0)
    with pytest.raises(InputError, match=r"^`spare`: unknown key 'aera'"):
        Boat(spare={"aera": 3})


def test_a_positional_argument_is_named():
    with pytest.raises(InputError, match=r"^`area` must be > 0 m\^2, got 0.0$"):
        Sail(0.0)


def test_arguments_that_do_not_exist_are_type_errors():
    with pytest.raises(
        TypeError, match=r"Sail\(\) got an unexpected keyword argument 'aera' \(did you mean 'area'"
    ):
        Sail(aera=3.0)
    with pytest.raises(TypeError, match=r"Motor\(\) misses the argument 'fuel'"):
        Motor(1.0)
    with pytest.raises(TypeError, match=r"Motor\(\) got an unexpected positional argument 2"):
        Motor(1.0, "diesel", 3)


def test_numpy_values_become_plain_ones():
    sail = Sail(np.float32(2.0), np.int64(3))
    assert (type(sail.area), type(sail.sheets)) == (float, int)
    with pytest.raises(InputError, match="`sheets` must be a whole number"):
        Sail(sheets=np.ones(3))
    assert Boat(hull=np.arange(3.0)).hull == (0.0, 1.0, 2.0)


def test_records_are_frozen_dataclasses():
    boat = Boat(sail=[Sail(), Sail(3.0)])
    assert hash(boat) == hash(Boat(sail=(Sail(), Sail(3.0))))
    assert pickle.loads(pickle.dumps(boat)) == copy.deepcopy(boat) == boat
    assert asdict(Sail()) == {"area": 12.0, "sheets": 2, "reefs": 0}
    assert [field.name for field in fields(Sail)] == ["area", "sheets", "reefs"]
    with pytest.raises(FrozenInstanceError):
        boat.length = 3.0
    assert is_record(Boat)
    assert not any(map(is_record, (boat, tuple, float)))


def test_unions_are_told_apart_by_kind():
    assert read({"kind": "raft", "logs": 5}, Boat | Raft) == Raft(logs=5)
    assert read({"kind": "yawl"}, Boat | Raft) == Boat(kind="yawl")
    with pytest.raises(InputError, match="unknown key 'logs'"):
        read({"kind": "yawl", "logs": 5}, Boat | Raft)
    for values, given in (({}, "None"), ({"kind": "rafd"}, r"'rafd' \(did"), (7, "None")):
        with pytest.raises(
            InputError, match=f"`kind` must be one of sloop, yawl, raft, got {given}"
        ):
            read(values, Boat | Raft)
    with pytest.raises(InputError, match="`kind` must be one of sloop, yawl, raft"):
        read({"kind": [1]}, Boat | Raft)


def test_retired_keys_of_old_files_are_dropped():
    assert read({"kind": "raft", "oars": 2, "logs": 5}, Raft) == Raft(logs=5)
    with pytest.raises(TypeError, match="unexpected keyword argument 'oars'"):
        Raft(oars=2)


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
    with pytest.raises(InputError, match=r"boat\.yaml: `sail\[0\]`: .*big\.yaml: unknown key"):
        read_record(Boat, tmp_path / "boat.yaml")
    (tmp_path / "boat.yaml").write_text("spare: small.yaml")
    with pytest.raises(InputError, match=r"`spare`: cannot read .*small\.yaml"):
        read_record(Boat, tmp_path / "boat.yaml")


def test_ranges_are_told_in_words():
    ranges = {name: range_text(field) for name, field in Boat.__pydantic_fields__.items()}
    assert ranges["length"] == "in (0, 100)"
    assert ranges["endurance"] == "> 0"
    assert ranges["depths"] == ">= 1"
    assert ranges["hull"] == ranges["sail"] == ranges["draught"] == ""
