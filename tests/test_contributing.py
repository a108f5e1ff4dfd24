"""Paths in CONTRIBUTING.md and in the index of tools/bench exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text()
INDEX = (ROOT / "tools/bench/README.md").read_text()
PATHS = sorted(set(re.findall(r"(?:drake_aerial|tests|tools)/[\w./]*\w/?", CONTRIBUTING)))


def test_contributing_names_paths_of_the_package():
    assert sum(path.startswith("drake_aerial/") for path in PATHS) >= 5


@pytest.mark.parametrize("path", PATHS)
def test_every_path_in_contributing_exists(path):
    assert (ROOT / path).exists()


def test_the_layout_table_names_every_package():
    table = CONTRIBUTING.split("## Layout")[1].split("\n## ")[0]
    named = {
        name
        for row in table.splitlines()
        if row.startswith("| `")
        for name in re.findall(r"`(\w+)`", row.split("|")[1])
    }
    packages = {path.parent.name for path in (ROOT / "drake_aerial").glob("*/__init__.py")}
    assert packages <= named
    assert all(
        (ROOT / "drake_aerial" / name).is_dir() or (ROOT / f"drake_aerial/{name}.py").is_file()
        for name in named
    )


def test_the_index_of_the_benches_names_every_script():
    scripts = {path.name for path in (ROOT / "tools/bench").glob("*.py")}
    assert set(re.findall(r"`(\w+\.py)`", INDEX)) == scripts
