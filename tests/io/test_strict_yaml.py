import pytest

from drake_aerial.errors import InputError
from drake_aerial.io.strict_yaml import check_keys, numbers, read_mapping


def test_files_that_hold_no_mapping_are_refused(tmp_path):
    path = tmp_path / "file.yaml"
    for text, word in (
        ("[1, 2]", "list"),
        ("a: [", "not YAML"),
        ("", "NoneType"),
        ("!!python/object:os.x {}", "not YAML"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=word):
            read_mapping(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"cannot read|not YAML"):
        read_mapping(path)
    with pytest.raises(InputError, match="cannot read"):
        read_mapping(tmp_path / "missing.yaml")


def test_unknown_and_missing_keys_are_named():
    with pytest.raises(
        InputError, match=r"unknown key 'mas' \(did you mean 'mass'\?\); accepted: box, mass"
    ):
        check_keys({"box": 1, "mas": 2}, required=("box",), optional=("mass",))
    with pytest.raises(InputError, match="'box' is missing"):
        check_keys({}, required=("box",))
    check_keys({"box": 1}, required=("box",), optional=("mass",))


@pytest.mark.parametrize("value", ["x", [1, 2], None, float("nan"), True, 10**400])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(InputError, match="a finite number"):
        numbers(value, (), "mass")


def test_numbers_have_a_shape():
    assert numbers([1, 2, 3], (3,), "position").tolist() == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match="3 finite numbers"):
        numbers([1, 2], (3,), "position")
    with pytest.raises(InputError, match="3 x 3 finite numbers"):
        numbers([1, 2, 3], (3, 3), "inertia")


@pytest.mark.parametrize(
    ("text", "value"),
    [("5e3", 5000.0), ("-1.5E-3", -0.0015), (".5e1", 5.0), ("inf", float("inf")), ("1e", "1e")],
)
def test_numbers_without_a_point_are_numbers(tmp_path, text, value):
    """YAML 1.1 reads 5e3 as a text."""
    (tmp_path / "file.yaml").write_text(f"key: {text}")
    assert read_mapping(tmp_path / "file.yaml") == {"key": value}
