"""The guides do what they show: the tests write their files, run their commands and code, and compare the output."""

import contextlib
import io
import re
import runpy
import shlex
import shutil
import sys
from pathlib import Path

import pytest
from guides import RUNNABLE, blocks, write_file

from drake_tracker import cli


def follow(language, body):
    """Executes a block of a guide in the current folder."""
    if write_file(body, Path.cwd()):
        return
    if language == "python":
        exec(compile(body, "<guide>", "exec"), {"__name__": "guide"})
    elif language == "console":
        for command, *shown in (text.splitlines() for text in body.split("$ ")[1:]):
            printed = output_of(command)
            assert re.search(pattern(shown), printed), f"$ {command}\n{printed}"


def output_of(command):
    """Runs a command and returns its output."""
    program, *arguments = shlex.split(command)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        if program == "python":
            runpy.run_path(*arguments, run_name="__main__")
        else:
            assert program == "drake-tracker"
            cli.main(arguments)
    return printed.getvalue()


def pattern(lines):
    """Returns the regular expression for the shown output: "…" matches anything, blanks match any blanks."""
    words = [r"[^\n]*".join(r"\s+".join(map(re.escape, part.split())) for part in line.split("…")) for line in lines]
    words = [r"[\s\S]*" if line == "…" else word for word, line in zip(words, lines)]
    return r"\s+".join(words).replace(r"\s+[\s\S]*", r"[\s\S]*")


def test_guides_with_code_are_found():
    assert {"arm", "build_your_own_diagram", "camera", "estimator", "track"} <= {path.stem for path in RUNNABLE}


@pytest.mark.parametrize("guide", RUNNABLE, ids=lambda path: path.stem)
def test_guide_does_what_it_shows(guide, tmp_path, monkeypatch):
    for script in guide.parent.glob("*.py"):
        shutil.copy(script, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    before = set(sys.modules)
    for language, body in blocks(guide):
        if language in ("python", "yaml", "console"):
            follow(language, body)
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            monkeypatch.delitem(sys.modules, name)


def test_a_diagram_of_your_own_is_short():
    (guide,) = (path for path in RUNNABLE if path.stem == "build_your_own_diagram")
    code = next(body for language, body in blocks(guide) if language == "python" and "add_triangulator" in body)
    assert len([line for line in code.splitlines() if line.strip()]) <= 35
    assert len(set(re.findall(r"^(?:from|import) (\w+)", code, re.MULTILINE))) <= 3
