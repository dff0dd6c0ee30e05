"""Generates the tables and numbers of the *Results* pages from the files in benchmarks/results.

Each public function of the modules in `MODULES` returns the Markdown text of one block; its name is the block's name.
"""

import importlib
import re
import textwrap
from collections.abc import Callable

MODULES = (
    *("headline", "papers", "train", "latency_curve", "rivals", "success", "vision", "estimators"),
    *(
        "ball",
        "autopsy",
        "faults",
        "tracking",
        "speed",
        "several",
        "eyes_open",
        "footage",
        "latency",
        "records",
        "fuzz",
        "dispatch",
        "conveyor",
        "provenance",
    ),
)
WIDTH = 120
_KEEP_LINES = re.compile(r"\||- |\d+\. ")
"""Beginning of a paragraph that is a table or a list."""
_NO_BREAK = "\N{WORD JOINER}"


def generators() -> dict[str, Callable[[], str]]:
    """Returns {name of a block: function that returns its Markdown text}."""
    from tables.marks import marking

    found = {}
    for name in MODULES:
        module = importlib.import_module(f"tables.{name}")
        for function in vars(module).values():
            if getattr(function, "__module__", None) == module.__name__ and _makes_block(function):
                found[function.__name__] = marking(function)
    return found


def wrapped(text: str) -> str:
    """Returns Markdown with its paragraphs in lines of `WIDTH`; tables and lists keep their lines.

    No line begins with a percent sign, which MyST reads as a comment.
    """
    wrapper = textwrap.TextWrapper(WIDTH, break_long_words=False, break_on_hyphens=False)
    parts = text.split("\n\n")
    filled = (part if _KEEP_LINES.match(part) else wrapper.fill(part.replace(" %", _NO_BREAK + "%")) for part in parts)
    return "\n\n".join(filled).replace(_NO_BREAK, " ")


def _makes_block(function: object) -> bool:
    """Returns whether a member of a module is a public function without parameters that returns a text."""
    annotations = getattr(function, "__annotations__", {})
    return not getattr(function, "__name__", "_").startswith("_") and annotations == {"return": str}
