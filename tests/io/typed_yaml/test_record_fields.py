from drake_aerial.io.typed_yaml.record_fields import MISSING, is_record, record_fields, summary
from tests.io.typed_yaml.boats import Boat, Motor, Sail


def test_meanings_are_those_of_strings_below_fields_and_of_docstring_sections():
    boat = {f.name: f for f in record_fields(Boat)}
    assert (boat["length"].meaning, boat["length"].default) == ("Over all [m].", 7.5)
    assert boat["sail"].default == Sail()
    sail = {f.name: f.meaning for f in record_fields(Sail)}
    assert sail == {
        "area": "Of the cloth [m^2].",
        "sheets": "sheets, reefs: How many.",
        "reefs": "",
    }
    assert [f.default for f in record_fields(Motor)] == [MISSING, MISSING]


def test_summaries_are_first_paragraphs():
    assert summary(Boat) == "A boat, with a summary of two lines."


def test_records_are_dataclasses_and_named_tuples():
    assert all(map(is_record, (Boat, Sail)))
    assert not any(map(is_record, (tuple, Sail(), float)))
