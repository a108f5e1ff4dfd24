"""docs/api/configuration.md states the range of every parameter; the classes keep to it."""

import re
from dataclasses import MISSING, fields, replace
from importlib import import_module
from math import inf, nan, nextafter, pi
from pathlib import Path
from pkgutil import walk_packages
from typing import get_args

import pytest

import drake_aerial
from drake_aerial import Dryden, FlightOptions, InputError, MpcParameters
from drake_aerial.choices import METHODS, Method
from drake_aerial.configuration import NOUNS, noun_class
from drake_aerial.estimation.mass_identification import IdentificationParameters
from drake_aerial.io.records import _leaves, is_record, range_text
from drake_aerial.plant.quadrotor import QuadrotorParameters
from drake_aerial.scene.parameters import SceneParameters
from drake_aerial.statics.lift import Lift

PAGE = Path(__file__).parents[1] / "docs" / "api" / "configuration.md"
ROW = re.compile(r"^\| `(\w+)\.(\w+)` \| ([^|]*) \| ([^|]*) \| (.*) \|$", re.MULTILINE)
OTHERS = (FlightOptions, IdentificationParameters, SceneParameters)
"""Records that no noun of a file names."""
BASES = {
    Lift: Lift(0.5, (7.0,), (0.25,)),
    Dryden: Dryden((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)),
    QuadrotorParameters: QuadrotorParameters(min_rpm=0.0),
}
SMALL = {"inertia": 1e-12}
"""Smallest values, where the smallest float is refused by a check that is not a range."""


def nested(kind):
    """Yield a record and those in it."""
    for leaf in _leaves(kind):
        if is_record(leaf):
            yield leaf
            for field in leaf.__pydantic_fields__.values():
                yield from nested(field.annotation)


PARAMETERS = sorted(
    {
        record
        for kind in (*(noun_class(noun) for noun in NOUNS if noun != "payload"), *OTHERS)
        for record in nested(kind)
    },
    key=lambda record: record.__name__,
)
FIELDS = {
    f"{record.__name__}.{name}": (record, name, field)
    for record in PARAMETERS
    for name, field in record.__pydantic_fields__.items()
}


def numeric(field):
    leaves = _leaves(field.annotation)
    return bool({int, float} & {leaf for leaf in leaves if isinstance(leaf, type)})


NUMBERS = {key: value for key, value in FIELDS.items() if numeric(value[2])}


def table():
    """Return the table of docs/api/configuration.md."""
    rows = ["| parameter | default | range | meaning |", "|---|---|---|---|"]
    for key, (_, _, field) in FIELDS.items():
        default = field.default_factory or field.default
        default = default.__name__ + "()" if isinstance(default, type) else default
        text = "required" if field.is_required() else f"{default!r}".strip("'")
        text = re.sub(r"\d+\.\d{6,}", lambda number: f"{float(number[0]):.4g}", text)
        meaning = " ".join(field.description.split()).replace("|", "\\|")
        rows.append(f"| `{key}` | {text} | {range_text(field)} | {meaning} |")
    return "\n".join(rows) + "\n"


def test_every_parameter_is_in_the_table_of_the_docs():
    assert table() in PAGE.read_text(), f"replace the table in {PAGE} by\n{table()}"


def test_every_class_of_parameters_in_the_package_is_in_the_table():
    for module in walk_packages(drake_aerial.__path__, "drake_aerial."):
        if "__main__" in module.name or ".testing" in module.name:
            continue
        for name, kind in vars(import_module(module.name)).items():
            if is_record(kind) and name.endswith(("Parameters", "Options", "Gains", "Weights")):
                assert kind in PARAMETERS, name


@pytest.mark.parametrize("key", FIELDS)
def test_every_parameter_has_a_meaning_and_every_number_a_unit(key):
    _, _, field = FIELDS[key]
    assert re.match(r"[A-Za-z]", field.description), key
    if float in _leaves(field.annotation):
        assert re.search(r"\[.+?\]|\(dimensionless\)", field.description), key


ANGLES = {3.14159: pi, 1.5708: pi / 2, -1.5708: -pi / 2}
"""Angles as the docs round them."""


def documented_range(key):
    """Return (low, high, low included, high included) as the docs have it."""
    ((_, _, _, text, _),) = [
        row for row in ROW.findall(PAGE.read_text()) if ".".join(row[:2]) == key
    ]
    text = text.strip()
    if match := re.fullmatch(r"in ([(\[])(\S+), (\S+)([)\]])", text):
        low, high = (ANGLES.get(float(text), float(text)) for text in match.group(2, 3))
        return low, high, match[1] == "[", match[4] == "]"
    if match := re.fullmatch(r"(>=?) (\S+)", text):
        return float(match[2]), inf, match[1] == ">=", False
    assert text == "", f"{key}: {text}"
    return -inf, inf, False, False


def changed(key, value):
    """Return the record with one number, or all numbers of one list, changed."""
    record, name, _ = NUMBERS[key]
    base = BASES.get(record) or record()
    known = getattr(base, name)
    if isinstance(known, (list, tuple)) or key == "MpcParameters.stages":
        value = (value,) * max(len(known), 2) if known else value
    if record is Lift and name != "payload_mass":
        value = (value[0],)
    return replace(base, **{name: value})


@pytest.mark.parametrize("key", NUMBERS)
def test_numbers_at_the_inside_edge_are_accepted(key):
    _, name, field = NUMBERS[key]
    low, high, closed_low, closed_high = documented_range(key)
    whole = int in _leaves(field.annotation)
    for bound, closed, inwards in ((low, closed_low, inf), (high, closed_high, -inf)):
        if abs(bound) == inf:
            continue
        inside = bound if closed else nextafter(bound, inwards)
        inside = SMALL.get(name, inside) if inwards == inf else inside
        changed(key, int(inside) if whole else inside)


@pytest.mark.parametrize("key", NUMBERS)
def test_numbers_outside_are_refused_in_one_grammar(key):
    _, name, field = NUMBERS[key]
    low, high, closed_low, closed_high = documented_range(key)
    whole = int in _leaves(field.annotation)
    infinite = "finite (.inf)" in field.description
    wrong = [nan, -inf, True, "1", "x", [], {}, b"1", object()]
    wrong += [] if infinite else [inf]
    wrong += [] if field.default is None else [None]
    for bound, closed, outwards in ((low, closed_low, -inf), (high, closed_high, inf)):
        if abs(bound) < inf:
            step = -1 if outwards < 0 else 1
            wrong.append(bound + 1e-4 * step if closed or abs(bound) > 1 else bound)
            wrong.append(int(bound) + step if whole else bound + 2.0 * step)
    for value in wrong:
        with pytest.raises(InputError) as refused:
            changed(key, value)
        message = str(refused.value)
        assert re.match(rf"`{name}(\[0\])?` must .*, got ", message), message
        assert "\n" not in message


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MpcParameters(stages=1), "`stages` must have at least 2 steps, got 1"),
        (lambda: MpcParameters(stages=[3]), "`stages` must have at least 2 steps, got (3,)"),
        (
            lambda: QuadrotorParameters(max_rpm=5000.0),
            "`min_rpm` must be < max_rpm = 5000, got 5500.0",
        ),
        (
            lambda: Lift(1.0, (7.0, 7.0), (0.25,)),
            "`quadrotor_mass` must have 2 entries like max_thrust, got 1",
        ),
    ],
)
def test_parameters_that_contradict_each_other_are_refused(make, message):
    with pytest.raises(InputError, match="^" + re.escape(message)):
        make()


def test_the_choices_of_methods_have_one_source():
    assert tuple(METHODS) == get_args(Method)


def test_records_without_defaults_are_in_the_bases():
    for record in PARAMETERS:
        if any(f.default is f.default_factory is MISSING for f in fields(record)):
            assert record in BASES
