import importlib.util
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "tools" / "bench"
TEXT = '''"""A docstring of 3 words."""
LIMIT: float = 2.0
Either = int | str


@cached(maxsize=5)
def f(a: "X[7]", b=1) -> "Y[8]":
    if b < 0 and a.T is not None:
        raise ValueError(f"b = {b + 1} is below {0}")
    a[0] = cross(a, b)
    a += -b * 1e-9
    return np.max(a @ b, axis=0)  # ü + 1
'''


@pytest.fixture(scope="module")
def mutations():
    spec = importlib.util.spec_from_file_location("mutations", TOOLS / "mutations.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutations"] = module  # its dataclass looks itself up there
    spec.loader.exec_module(module)
    yield module
    del sys.modules["mutations"]


@pytest.fixture
def found(mutations, tmp_path):
    (tmp_path / "some.py").write_text(TEXT)
    return mutations.mutants_of("some.py", tmp_path / "some.py")


def test_every_mutant_is_another_program_of_one_changed_line(found):
    assert len(found) > 20
    assert len({mutant.text for mutant in found}) == len(found)
    lines = TEXT.splitlines()
    for mutant in found:
        compile(mutant.text, "some.py", "exec")
        changed = [k for k, (a, b) in enumerate(zip(lines, mutant.text.splitlines()), 1) if a != b]
        assert changed == [mutant.line]
        assert mutant.before.split() == lines[mutant.line - 1].split()
        assert mutant.after.split() == mutant.text.splitlines()[mutant.line - 1].split()


def test_kinds_of_changes(found):
    after = {mutant.after for mutant in found}
    assert after >= {
        "LIMIT: float = 4.0",
        "if b <= 0 and a.T is not None:",
        "if b < 0 or a.T is not None:",
        "if b < 0 and a is not None:",
        "if b < 1 and a.T is not None:",
        "pass",
        "a[0] = cross(b, a)",
        "a -= -b * 1e-9",
        "a += (b) * 1e-9",
        "a += -b * 0.0",
        "return np.min(a @ b, axis=0) # ü + 1",
        "return np.max(((b) @ (a)), axis=0) # ü + 1",
        "return np.max(a @ b, axis=1) # ü + 1",
    }


def test_messages_annotations_and_decorators_are_left_alone(found):
    assert {mutant.line for mutant in found}.isdisjoint({1, 3, 6, 9})
    assert all('a: "X[7]"' in mutant.text and '-> "Y[8]"' in mutant.text for mutant in found)
