"""Importing the package and printing help load nothing heavy."""

import subprocess
import sys

import pytest

HEAVY = (
    "numpy",
    "scipy",
    "pydrake",
    "open3d",
    "trimesh",
    "matplotlib",
    "piqp",
    "dask",
    "distributed",
    "yaml",
    "pydantic",
    "pytest",
)
HELP = """
import contextlib, io
from drake_aerial.cli import main
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
    main({})
"""


@pytest.mark.parametrize(
    "action",
    [
        "import drake_aerial",
        "import drake_aerial; dir(drake_aerial)",
        HELP.format(["--help"]),
        HELP.format(["fly", "--help"]),
    ],
    ids=["import", "dir", "help", "help of a command"],
)
def test_nothing_heavy_is_loaded(action):
    code = f"{action}\nimport sys; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert "drake_aerial" in loaded
    assert not set(HEAVY) & set(loaded)
