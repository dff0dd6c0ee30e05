"""The notebooks run from top to bottom as they are, and are kept without what they print."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))

SAYS = {
    "01_train.ipynb": "vision_valid_fraction  1.0",
    "02_arc_length.ipynb": "recovered s_0 2.5",
    "03_ball.ipynb": "caught at",
    "04_your_own_estimator.ipynb": "lifted\n",
    "05_campaign.ipynb": "12 trials",
}
"""What must be among the text that each prints."""


def read(path):
    return nbformat.read(path, as_version=4)


def outputs_of(notebook):
    return [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]


def test_there_are_notebooks():
    assert [path.name for path in NOTEBOOKS] == sorted(SAYS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebook_is_kept_without_outputs(path):
    notebook = read(path)
    assert outputs_of(notebook) == []
    assert all(cell.execution_count is None for cell in notebook.cells if cell.cell_type == "code")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebook_runs(path, tmp_path):
    notebook = read(path)
    here = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=240, kernel_name="python3", resources=here).execute()
    outputs = outputs_of(notebook)
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 3
    printed = "".join(output.text for output in outputs if output.output_type == "stream")
    assert SAYS[path.name] in printed
    assert not list(tmp_path.iterdir()), "a notebook leaves nothing where it was started"
