"""The guides do what they show: files are written, commands given, code run, and what is printed is compared."""

import contextlib
import io
import re
import runpy
import shlex
import sys
from pathlib import Path

import pytest
from guides import GUIDES, blocks, write_file

from drake_tracker import cli


def follow(language, body):
    """Does what a block of a guide says, in the current folder."""
    if write_file(body, Path.cwd()):
        return
    if language == "python":
        exec(compile(body, "<guide>", "exec"), {"__name__": "guide"})
    elif language == "console":
        for command, *shown in (text.splitlines() for text in body.split("$ ")[1:]):
            printed = give(command)
            assert re.search(pattern(shown), printed), f"$ {command}\n{printed}"


def give(command):
    """Returns what a command prints."""
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
    """The regular expression of what is shown: "…" stands for anything, blanks for any blanks."""
    words = [r"[^\n]*".join(r"\s+".join(map(re.escape, part.split())) for part in line.split("…")) for line in lines]
    words = [r"[\s\S]*" if line == "…" else word for word, line in zip(words, lines)]
    return r"\s+".join(words).replace(r"\s+[\s\S]*", r"[\s\S]*")


def test_there_are_guides():
    assert [path.stem for path in GUIDES] == ["arm", "camera", "estimator", "index", "track"]


@pytest.mark.parametrize("guide", [path for path in GUIDES if path.stem != "index"], ids=lambda path: path.stem)
def test_guide_does_what_it_shows(guide, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    before = set(sys.modules)
    for language, body in blocks(guide):
        if language in ("python", "yaml", "console"):
            follow(language, body)
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", "")):
            monkeypatch.delitem(sys.modules, name)
