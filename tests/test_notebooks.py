"""Every notebook runs without a screen, is committed without outputs, and leaves no files."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
# A notebook begins without names, figures or working directory of the one before it.
FRESH = """
import os, sys
if "matplotlib" in sys.modules:
    import matplotlib.pyplot as plt
    plt.close("all"), plt.rcdefaults()
os.chdir({folder!r})
%reset -f
"""


@pytest.fixture(scope="module")
def client():
    """A client of one kernel for all notebooks, which imports the libraries once."""
    client = NotebookClient(nbformat.v4.new_notebook(), timeout=300, kernel_name="python3")
    with client.setup_kernel():
        yield client


def execute(client: NotebookClient, notebook: nbformat.NotebookNode, folder: Path) -> None:
    """Run the cells of a notebook in a folder, without the names of notebooks before it."""
    fresh = nbformat.v4.new_code_cell(FRESH.format(folder=str(folder)))
    for content in (nbformat.v4.new_notebook(cells=[fresh]), notebook):
        client.nb = content
        client.execute(cleanup_kc=False)


def test_the_stories_are_numbered_and_listed():
    assert [path.name[:3] for path in NOTEBOOKS] == ["00_", "01_", "02_", "03_", "04_", "05_"]
    page = (ROOT / "docs" / "notebooks.md").read_text()
    assert [path.name for path in NOTEBOOKS if path.name not in page] == []


def test_a_notebook_does_not_see_the_names_of_the_one_before_it(client, tmp_path):
    cell = nbformat.v4.new_code_cell
    execute(client, nbformat.v4.new_notebook(cells=[cell("left = 1")]), tmp_path)
    notebook = nbformat.v4.new_notebook(
        cells=[cell("import os; 'left' in dir(), os.path.basename(os.getcwd())")]
    )
    execute(client, notebook, tmp_path)
    (output,) = notebook.cells[0].outputs
    assert output.data["text/plain"] == str((False, tmp_path.name))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_notebook_runs(path, client, tmp_path):
    notebook = nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code), "committed with outputs"
    execute(client, notebook, tmp_path)
    outputs = [output for cell in code for output in cell.outputs]
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 3
    assert list(tmp_path.iterdir()) == [], "files written beside the notebook"
    warned = [o.text for o in outputs if o.output_type == "stream" and "Warning" in o.text]
    assert warned == []
