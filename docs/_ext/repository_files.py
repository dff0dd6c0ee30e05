"""Shows documents of the repository, or sections of them, as pages: what stands there is not written again.

A page has a line such as ``<!-- show: ../README.md, from "## Two commands", to "## How data flows" -->``; with neither
it is the whole document. Links to what is shown on some page lead there, links to other files download them.
"""

import os
import re
from pathlib import Path

DOCS = Path(__file__).parents[1]
SHOW = re.compile(r'^<!-- show: (\S+?)(?:, from "(.+?)")?(?:, to "(.+?)")? -->$', re.MULTILINE)
LINK = re.compile(r"\]\(([^)\s:#]*)(#[^)\s]*)?\)")
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def show(app, docname, source):
    """Puts the documents that a page shows into it."""
    page = DOCS / f"{docname}.md"
    shown = shown_where()

    def document(match):
        path = (page.parent / match.group(1)).resolve()
        app.env.note_dependency(str(path), docname=docname)
        return LINK.sub(lambda link: f"]({target(link, path, page, shown)})", section(path, *match.groups()[1:]))

    source[0] = SHOW.sub(document, source[0])


def section(path, first=None, last=None):
    """Returns the text of a document from a line on, and up to another. Raises ValueError when it has no such."""
    lines = path.read_text(encoding="utf-8").splitlines()
    for line in (first, last):
        if line and line not in lines:
            raise ValueError(f"{path.name} has no line {line!r}")
    start = lines.index(first) if first else 0
    end = lines.index(last) if last else len(lines)
    return "\n".join(lines[start:end]) + "\n"


def shown_where():
    """Returns {(document, "#anchor" of a heading in it): page that shows it}, with "" for the document itself."""
    where = {}
    for page in sorted(DOCS.rglob("*.md")):
        for name, first, last in SHOW.findall(page.read_text(encoding="utf-8")):
            path = (page.parent / name).resolve()
            where.setdefault((path, ""), page)
            text = FENCE.sub("", section(path, first, last))
            where |= {(path, anchor_of(heading)): page for heading in re.findall(r"^#+ (.+)$", text, re.MULTILINE)}
    return where


def anchor_of(heading):
    """Returns the anchor of a heading, as GitHub makes it."""
    return "#" + re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def target(link, path, page, shown):
    """Returns what a link of the document ``path`` is on the page ``page``."""
    file, anchor = link.groups(default="")
    goal = (path.parent / file).resolve() if file else path
    there = shown.get((goal, anchor), shown.get((goal, ""), goal))
    if there == page and anchor:
        return anchor
    download = "path:" if DOCS not in there.parents else ""
    return download + os.path.relpath(there, page.parent) + anchor


def setup(app):
    app.connect("source-read", show)
    return {"parallel_read_safe": True}
