"""Writes the generated tables and numbers into the documents, from the files in benchmarks/results.

    python docs/make_tables.py              all documents
    python docs/make_tables.py --check      change nothing; exit with 1 and name the blocks that differ
    python docs/make_tables.py --print NAME print one block

A document holds a block between ``<!-- table: NAME -->`` and ``<!-- end table -->``. NAME is a function of a module in
docs/tables.
"""

import argparse
import difflib
import re
import sys
from collections.abc import Callable
from pathlib import Path

DOCS = Path(__file__).resolve().parent
REPOSITORY = DOCS.parent
sys.path[:0] = [str(DOCS), str(REPOSITORY / "benchmarks")]

from tables import generators, wrapped  # noqa: E402

BLOCK = re.compile(r"(<!-- table: (\S+) -->\n)(.*?)(<!-- end table -->)", re.DOTALL)


def documents() -> list[Path]:
    """Returns all Markdown files of the repository that may hold a block."""
    patterns = ("*.md", "benchmarks/*.md", "docs/**/*.md")
    return sorted(path for pattern in patterns for path in REPOSITORY.glob(pattern) if "_build" not in path.parts)


def updated(text: str, functions: dict[str, Callable[[], str]]) -> tuple[str, dict[str, tuple[str, str]]]:
    """Returns a document with new blocks, and {name: (old, new)} of the blocks that differ.

    Raises KeyError for a block that no function makes.
    """
    differing = {}

    def replace(match: re.Match[str]) -> str:
        start, name, old, end = match.groups()
        new = f"\n{wrapped(functions[name]())}\n\n"
        if new != old:
            differing[name] = (old, new)
        return start + new + end

    return BLOCK.sub(replace, text), differing


def difference(before: str, after: str) -> list[str]:
    """Returns the lines by which a block of a document differs from what the results say."""
    return list(difflib.unified_diff(before.splitlines(), after.splitlines(), "document", "results", n=0, lineterm=""))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("documents", nargs="*", type=Path, help="default: all documents of the repository")
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 when a block differs")
    parser.add_argument("--print", metavar="NAME", dest="name", help="print one block")
    options = parser.parse_args()
    functions = generators()
    if options.name:
        if options.name not in functions:
            parser.error(f"no block {options.name}; there are {', '.join(sorted(functions))}")
        print(wrapped(functions[options.name]()))
        return 0
    status = 0
    for path in options.documents or documents():
        try:
            text, differing = updated(path.read_text(encoding="utf-8"), functions)
        except KeyError as error:
            parser.error(f"{path}: no function makes the block {error}")
        for name, (before, after) in differing.items():
            print(f"{path}: {name} {'differs' if options.check else 'written'}")
            if options.check:
                status = 1
                print(*difference(before, after), sep="\n")
        if differing and not options.check:
            path.write_text(text, encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main())
