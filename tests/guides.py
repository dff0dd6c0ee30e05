"""The guides of docs/how_to: their blocks of code, some of which are files."""

import re
from pathlib import Path

GUIDES = sorted((Path(__file__).parents[1] / "docs" / "how_to").glob("*.md"))
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\S+\.(?:py|yaml))\n")
"""First line of a block that is a file, rather than code to run."""
RUN = ("python", "console")
"""Languages of the blocks that a test runs; yaml blocks are files or fragments."""


def blocks(guide):
    """Returns (language, text) of each block of a guide."""
    return FENCE.findall(guide.read_text(encoding="utf-8"))


def write_file(text, folder):
    """Writes a block that is a file; returns whether it is one."""
    file = FILE.match(text)
    if file:
        path = folder / file[1]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return bool(file)


RUNNABLE = [guide for guide in GUIDES if any(language in RUN for language, _ in blocks(guide))]
"""Guides with code or commands that a test runs."""
