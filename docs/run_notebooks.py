"""Runs the notebooks and stores them with their output, for the tutorials of the documentation.

python docs/run_notebooks.py [NAME ...]     all notebooks, or those whose file names begin with NAME
"""

import argparse
import io
import tempfile
import time
from base64 import b64decode, b64encode
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

NOTEBOOKS = Path(__file__).resolve().parents[1] / "notebooks"
COLOURS = 128
"""Colours of the stored pictures; plots need few."""


def run(path):
    """Runs a notebook in an empty folder and stores it with its output."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources=resources, record_timing=False)
        client.execute()
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs = merged(cell.outputs)
            for output in cell.outputs:
                shrink(output)
    for key in ("language_info", "widgets"):
        notebook.metadata.pop(key, None)
    nbformat.write(notebook, path)


def merged(outputs):
    """Returns the outputs of a cell with its printed text in one piece; how a kernel divides it depends on time."""
    kept = []
    for output in outputs:
        last = kept[-1] if kept else None
        if output.output_type == "stream" and last and last.output_type == "stream" and last.name == output.name:
            last.text += output.text
        else:
            kept.append(output)
    return kept


def shrink(output):
    """Reduces the colours of a picture, and keeps the other output as it is."""
    data = output.get("data", {})
    if "image/png" in data:
        small = io.BytesIO()
        image = Image.open(io.BytesIO(b64decode(data["image/png"]))).convert("RGB")
        image.quantize(COLOURS, dither=Image.Dither.NONE).save(small, "PNG", optimize=True)
        data["image/png"] = b64encode(small.getvalue()).decode()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    options = parser.parse_args()
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        if not options.names or path.name.startswith(tuple(options.names)):
            start = time.monotonic()
            run(path)
            print(f"{path.name}: {time.monotonic() - start:.0f} s, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
