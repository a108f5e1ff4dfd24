import json

import pytest
import yaml

from drake_aerial.io.typed_yaml.reading import read_record, record_from_mapping
from drake_aerial.io.typed_yaml.writing import record_to_mapping, record_to_yaml
from tests.io.typed_yaml.boats import Boat, Motor, Sail

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
    Boat(sail=(Sail(1.0), Sail(2.0, 3, 4)), motor=Motor(1e22, "null"), name=""),
]


@pytest.mark.parametrize("boat", BOATS)
def test_what_is_written_reads_back_equal(boat, tmp_path):
    (tmp_path / "boat.yaml").write_text(record_to_yaml(boat))
    assert read_record(Boat, tmp_path / "boat.yaml") == boat
    assert (
        record_from_mapping(Boat, json.loads(json.dumps(record_to_mapping(boat))), "boat") == boat
    )


@pytest.mark.parametrize("boat", BOATS)
def test_another_reader_of_yaml_finds_the_same(boat):
    assert yaml.safe_load(record_to_yaml(boat)) == record_to_mapping(boat)


def test_every_meaning_is_a_comment():
    text = record_to_yaml(Boat())
    assert text.startswith("# A boat, with a summary of two lines.\n\n")
    assert "length: 7.5  # Over all [m].\n" in text
    assert "endurance: .inf  # [h] (.inf is infinite)\n" in text
    assert "wooden: false  # Whether null of it is steel.\n" in text
    assert "  sheets: 2  # sheets, reefs: How many.\n  reefs: 0\n" in text
    assert "motor: null  # null for none.\n# motor: {power: ..., fuel: ...}\n" in text
    assert max(map(len, text.splitlines())) <= 112


def test_what_is_left_out_can_be_taken_in():
    text = (
        record_to_yaml(Boat())
        .replace("spare: null  # null for none.\n", "")
        .replace("# spare:", "spare:")
    )
    text = (
        text.replace("#   area", "  area")
        .replace("#   sheets", "  sheets")
        .replace("#   reefs", "  reefs")
    )
    assert record_from_mapping(Boat, yaml.safe_load(text), "boat") == Boat(spare=Sail())
