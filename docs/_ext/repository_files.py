"""Shows files of the repository as pages.

- A page with the line ``<!-- show: ../CHANGELOG.md -->`` shows that document.
- Every notebook of ``notebooks/`` is a page of ``tutorials/``.
- Links to files of the repository lead to the page that shows the file. Links to files without a page download them.
"""

import json
import os
import re
from functools import cache
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
REPOSITORY = DOCS.parent
NOTEBOOKS = REPOSITORY / "notebooks"
TUTORIALS = DOCS / "tutorials"
SHOW = re.compile(r"^<!-- show: (\S+) -->$", re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s:#]+)(#[^)\s]*)?\)")


@cache
def pages():
    """Returns {file of the repository: page that shows it}."""
    shown = {path: TUTORIALS / path.name for path in sorted(NOTEBOOKS.glob("*.ipynb"))}
    for page in sorted(DOCS.rglob("*.md")):
        for name in SHOW.findall(page.read_text(encoding="utf-8")):
            shown[(page.parent / name).resolve()] = page
    return shown


def with_links(text, path, page):
    """Returns the text of a document with its links as they must be on a page.

    Args:
        text: of the document, in Markdown.
        path: of the document; its links are relative to this path.
        page: path of the page that shows the document.
    """

    def link(match):
        file, anchor = match.groups(default="")
        goal = (path.parent / file).resolve()
        goal = pages().get(goal, goal)
        download = "" if DOCS in goal.parents else "path:"
        return f"]({download}{os.path.relpath(goal, page.parent)}{anchor})"

    return LINK.sub(link, text)


def show(app, docname, source):
    """Inserts the document that a page shows, and adapts the links of the page."""
    page = DOCS / f"{docname}.md"
    if not page.is_file():
        return

    def document(match):
        path = (page.parent / match.group(1)).resolve()
        app.env.note_dependency(str(path), docname=docname)
        return with_links(path.read_text(encoding="utf-8"), path, page)

    pieces = SHOW.split(source[0])
    shown = [document(match) for match in SHOW.finditer(source[0])]
    own = [with_links(piece, page, page) for piece in pieces[::2]]
    source[0] = "".join(text for pair in zip(own, [*shown, ""]) for text in pair)


def copy_notebooks(app):
    """Copies the notebooks, with their output, to where Sphinx finds them."""
    for page in TUTORIALS.glob("*.ipynb"):
        if not (NOTEBOOKS / page.name).exists():  # of a notebook that was renamed
            page.unlink()
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        notebook = json.loads(path.read_text(encoding="utf-8"))
        page = TUTORIALS / path.name
        for cell in notebook["cells"]:
            if cell["cell_type"] == "markdown":
                cell["source"] = with_links("".join(cell["source"]), path, page)
        text = json.dumps(notebook)
        if not page.is_file() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def setup(app):
    app.connect("builder-inited", copy_notebooks)
    app.connect("source-read", show)
    return {"parallel_read_safe": True}
