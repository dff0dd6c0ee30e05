"""The notebooks run from top to bottom as they are, and are stored with their output."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))
LARGEST = 400_000
"""Size of a notebook with its output [bytes]."""

PRINTED = {
    "01_train.ipynb": "vision_valid_fraction  1.0",
    "02_arc_length.ipynb": "recovered s_0 2.5",
    "03_ball.ipynb": "caught at",
    "04_your_own_estimator.ipynb": "lifted\n",
    "05_campaign.ipynb": "12 trials",
    "06_conveyor.ipynb": "capacity: ",
}
"""Text in the output of each."""


def read(path):
    return nbformat.read(path, as_version=4)


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def outputs_of(notebook):
    return [output for cell in code_cells(notebook) for output in cell.outputs]


def kinds(cell):
    """What a cell puts out: text, pictures. A kernel may divide the text into several outputs."""
    return {kind for output in cell.outputs for kind in output.get("data", {"text": ""})}


def check_output(notebook, name):
    outputs = outputs_of(notebook)
    assert not any(output.output_type == "error" for output in outputs)
    assert sum("image/png" in output.get("data", {}) for output in outputs) >= 3
    printed = "".join(output.text for output in outputs if output.output_type == "stream")
    assert PRINTED[name] in printed


def test_there_are_notebooks():
    assert [path.name for path in NOTEBOOKS] == sorted(PRINTED)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebook_is_stored_with_its_output(path):
    notebook = read(path)
    counts = [cell.execution_count for cell in code_cells(notebook)]
    assert counts == list(range(1, len(counts) + 1)), "python docs/run_notebooks.py runs it again"
    check_output(notebook, path.name)
    warnings = [output for output in outputs_of(notebook) if output.get("name") == "stderr"]
    assert not warnings
    assert path.stat().st_size < LARGEST
    assert "/tmp/" not in "".join(output.get("text", "") for output in outputs_of(notebook))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.name)
def test_notebook_runs(path, tmp_path):
    stored, notebook = read(path), read(path)
    here = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=240, kernel_name="python3", resources=here).execute()
    check_output(notebook, path.name)
    for before, after in zip(code_cells(stored), code_cells(notebook), strict=True):
        if "graphviz" not in after.source.lower() and "which(" not in after.source:
            assert kinds(before) == kinds(after), "python docs/run_notebooks.py runs it again"
    assert not list(tmp_path.iterdir()), "a notebook leaves nothing where it was started"
