import json

import pytest
import yaml

from drake_aerial.io.record_text import record_to_mapping, record_to_yaml
from drake_aerial.io.records import read_record, record_from_mapping
from tests.io.boats import Boat, Motor, Sail

BOATS = [
    Boat(),
    Boat(
        kind="yawl",
        length=1 / 3,
        endurance=4.0,
        depths=(7,),
        name="a: 'b' # c",
        wooden=True,
        spare=Sail(1e-300),
    ),
    Boat(sail=(Sail(1.0), Sail(2.0, 3, 4)), motor=Motor(1e22, "null"), name="", draught=-1e22),
]


@pytest.mark.parametrize("boat", BOATS)
def test_what_is_written_reads_back_equal(boat, tmp_path):
    (tmp_path / "boat.yaml").write_text(record_to_yaml(boat))
    assert read_record(Boat, tmp_path / "boat.yaml") == boat
    document = json.loads(json.dumps(record_to_mapping(boat)))
    assert record_from_mapping(Boat, document, "boat") == boat


@pytest.mark.parametrize("boat", BOATS)
def test_another_reader_of_yaml_finds_the_same(boat):
    assert yaml.safe_load(record_to_yaml(boat)) == record_to_mapping(boat)


def test_every_meaning_and_range_is_a_comment():
    text = record_to_yaml(Boat())
    assert text.startswith("# A boat, with a summary of two lines.\n\n")
    assert "length: 7.5  # Length over all [m]. Must be in (0, 100).\n" in text
    assert "endurance: .inf  # Endurance [h]. Must be > 0.\n" in text
    assert "wooden: false  # null of it is steel.\n" in text
    assert "  sheets: 2  # Number of sheets. Must be >= 1.\n  reefs: 0" in text
    assert "motor: null  # null for none.\n# motor: {power: ..., fuel: ...}\n" in text
    assert max(map(len, text.splitlines())) <= 100


def test_a_record_that_is_left_out_can_be_taken_in():
    text = record_to_yaml(Boat())
    text = text.replace("spare: null  # null for none.\n", "").replace("# spare:", "spare:")
    for key in ("area", "sheets", "reefs"):
        text = text.replace(f"#   {key}", f"  {key}")
    assert record_from_mapping(Boat, yaml.safe_load(text), "boat") == Boat(spare=Sail())
