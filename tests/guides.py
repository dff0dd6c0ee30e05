"""What the guides of docs/how_to show: blocks of code, of which some are files."""

import re
from pathlib import Path

GUIDES = sorted((Path(__file__).parents[1] / "docs" / "how_to").glob("*.md"))
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\S+\.(?:py|yaml))\n")
"""First line of a block that is a file, rather than code to run."""


def blocks(guide):
    """Returns (language, text) of each block of a guide."""
    return FENCE.findall(guide.read_text(encoding="utf-8"))


def write_file(text, folder):
    """Writes a block that is a file; returns whether it is one."""
    file = FILE.match(text)
    if file:
        (folder / file[1]).write_text(text, encoding="utf-8")
    return bool(file)
