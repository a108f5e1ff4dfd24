"""Every public name has a docstring; those of the root name their arrays, shapes and units."""

import ast
import doctest
import inspect
from pathlib import Path

import pytest

import drake_aerial

PACKAGE = Path(drake_aerial.__file__).parent


def public_definitions(path: Path):
    """Yield dotted name and node of a module's public functions, classes and methods."""

    def walk(node, prefix):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                if child.name.startswith("_"):
                    continue
                yield f"{prefix}{child.name}", child
                if isinstance(child, ast.ClassDef):
                    yield from walk(child, f"{prefix}{child.name}.")

    yield from walk(ast.parse(path.read_text()), "")


@pytest.mark.parametrize(
    "path", sorted(PACKAGE.rglob("*.py")), ids=lambda p: str(p.relative_to(PACKAGE))
)
def test_every_public_name_has_a_docstring(path):
    assert ast.get_docstring(ast.parse(path.read_text())), f"{path.name} has no module docstring"
    missing = [name for name, node in public_definitions(path) if not ast.get_docstring(node)]
    assert not missing, f"without a docstring: {missing}"


def array_members(value) -> list[str]:
    """Return the names of a function's or dataclass's array members, by their annotations."""
    if inspect.isclass(value):
        annotations = {
            k: v for k, v in inspect.get_annotations(value).items() if not k.startswith("_")
        }
    else:
        annotations = {k: v for k, v in inspect.get_annotations(value).items() if k != "return"}
    return [
        name for name, kind in annotations.items() if "Array" in str(kind) or "ndarray" in str(kind)
    ]


@pytest.mark.parametrize("name", drake_aerial.__all__)
def test_root_names_exist_and_document_shapes_and_units(name):
    value = getattr(drake_aerial, name)
    text = inspect.getdoc(value)
    assert text, f"{name} has no docstring"
    for member in array_members(value):
        lines = [line for line in text.splitlines() if member in line]
        assert lines, f"{name}: {member} is an array and is not in the docstring"
        start = text.index(lines[0])
        entry = text[start : start + 400]
        assert "(" in entry, f"{name}: {member} has no shape"
    if array_members(value):
        assert "[" in text, f"{name} holds or takes arrays and gives no unit in square brackets"
    assert ".." not in name


LONG = {"run_demo"}
"""What has no example: the demo takes a minute, and README shows it."""


def examples(name: str) -> list[doctest.DocTest]:
    """Return the examples of a public name and of its own methods."""
    value = getattr(drake_aerial, name)
    found = doctest.DocTestFinder(exclude_empty=True).find(value, name, globs={})
    return [example for example in found if example.examples]


@pytest.mark.parametrize("name", sorted(set(drake_aerial.__all__) - LONG))
def test_root_names_have_examples_that_run(name):
    found = examples(name)
    if not (inspect.isclass(getattr(drake_aerial, name)) and name.endswith(("Error", "Summary"))):
        assert found, f"{name} has no example"
    for example in found:
        lines: list[str] = []
        result = doctest.DocTestRunner().run(example, out=lines.append)
        assert result.failed == 0, "".join(lines)
