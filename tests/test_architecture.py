"""The rooms and their order: a room imports only from rooms before it."""

import ast
from pathlib import Path

import pytest

import drake_aerial

PACKAGE = Path(drake_aerial.__file__).parent

# What each room may import from. `plant` and `control` stand on perception alone, never on learning or transfer.
GROUND = {
    "errors",
    "geometry",
    "model_files",
    "files",
    "strict_yaml",
    "typed_yaml",
    "blas_threads",
    "cores",
    "archives",
}
ALLOWED = {
    "perception": GROUND,
    "density": GROUND | {"perception"},
    "learning": GROUND | {"perception", "density"},
    "transferring": GROUND | {"perception", "density", "learning"},
    "plant": GROUND | {"perception"},
    "control": GROUND | {"perception", "plant"},
    "transport": GROUND | {"perception", "density", "learning", "transferring", "plant", "control"},
}
ALLOWED["demonstrating"] = GROUND | {"perception", "density", "learning"}
ALLOWED["drawing"] = GROUND | (set(ALLOWED) - {"demonstrating"})
ALLOWED["study"] = ALLOWED["drawing"] | {"drawing"}


def imported_rooms(path: Path) -> set[str]:
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import hides which room it comes from"
            names = [node.module or ""]
            if node.module == "drake_aerial":
                names = [f"drake_aerial.{alias.name}" for alias in node.names]
        else:
            continue
        rooms |= {name.split(".")[1] for name in names if name.startswith("drake_aerial.")}
    return rooms


@pytest.mark.parametrize("room", sorted(ALLOWED))
def test_rooms_import_only_from_rooms_before_them(room):
    files = sorted((PACKAGE / room).rglob("*.py"))
    if room != "study":
        assert files, f"room {room} is empty"
    for path in files:
        foreign = imported_rooms(path) - ALLOWED[room] - {room}
        assert not foreign, f"{path.relative_to(PACKAGE)} imports {sorted(foreign)}"


def test_the_ground_imports_nothing_of_the_rooms():
    for name in GROUND:
        for path in (PACKAGE / f"{name}.py", *(PACKAGE / name).rglob("*.py")):
            if path.exists():
                assert imported_rooms(path) <= GROUND, path


def test_no_file_is_a_drawer():
    drawers = {"utils.py", "util.py", "helpers.py", "common.py", "misc.py"}
    assert not [p for p in PACKAGE.rglob("*.py") if p.name in drawers]
