"""What the documents point at exists: functions, files, links, commands, scenarios, pictures."""

import argparse
import ast
import re
import runpy
import shlex
import sys
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import pytest
from guides import GUIDES, write_file
from guides import blocks as guide_blocks

import drake_tracker
from drake_tracker import cli
from drake_tracker.commands import common
from drake_tracker.tasks import load_scenario

REPOSITORY = Path(__file__).parents[1]
DOCUMENTS = sorted(
    path
    for pattern in ("*.md", "benchmarks/*.md", "docs/**/*.md", "models/*/README.md")
    for path in REPOSITORY.glob(pattern)
)
README = REPOSITORY / "README.md"
ARCHITECTURE = REPOSITORY / "ARCHITECTURE.md"
PICTURES_LIMIT = 1_700_000
"""Size of all pictures together [bytes]."""

POINTER = re.compile(r"`([\w/]+\.py)::([\w.]+)`")
FILE = re.compile(r"`([\w./-]+/[\w.-]+\.(?:py|yaml|md|sdf|ipynb))`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"`(drake-tracker [^`]+)`")


def relative(path):
    return path.relative_to(REPOSITORY).as_posix()


def text_of(path):
    return path.read_text(encoding="utf-8")


def blocks(path, language):
    return [body for found, body in FENCE.findall(text_of(path)) if found == language]


@cache
def find(name):
    """The file that a document means: relative to the package, or else to the repository."""
    for folder in (REPOSITORY / "drake_tracker", REPOSITORY):
        if (folder / name).is_file():
            return folder / name
    return None


@cache
def names_in(path):
    """Names that a module defines at its top, and Class.name of what its classes define."""
    return set(_defined(ast.parse(text_of(path)).body, ""))


def _defined(body, prefix):
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield prefix + node.name
        if isinstance(node, ast.ClassDef):
            yield from _defined(node.body, f"{prefix}{node.name}.")
        elif isinstance(node, ast.Assign):
            yield from (prefix + leaf.id for target in node.targets for leaf in ast.walk(target) if hasattr(leaf, "id"))
        elif isinstance(node, ast.AnnAssign):
            yield prefix + node.target.id


def pointers(path):
    return sorted(set(POINTER.findall(text_of(path))))


@pytest.mark.parametrize(("file", "name"), pointers(ARCHITECTURE), ids="::".join)
def test_what_a_pointer_names_is_defined(file, name):
    path = find(file)
    assert path is not None, f"there is no {file}"
    assert name in names_in(path), f"{file} does not define {name}"


def test_every_equation_and_step_of_the_paper_is_in_the_table():
    table = text_of(ARCHITECTURE).split("## Where is equation N?")[1].split("\n## ")[0]
    first = " ".join(row.split("|")[1] for row in table.splitlines() if row.startswith("|"))
    assert {int(number) for number in re.findall(r"\((\d+)\)", first)} == set(range(1, 22))
    steps = set()
    for low, high in re.findall(r"steps? (\d+)(?:-(\d+))?", first):
        steps |= set(range(int(low), int(high or low) + 1))
    assert steps == set(range(1, 12))
    for part in ("figure 11", "appendix C", "section 4.3", "section 4.4", "section 5"):
        assert part in first, part


@pytest.mark.parametrize("path", DOCUMENTS, ids=relative)
def test_files_and_links_lead_somewhere(path):
    text = text_of(path)
    for name in FILE.findall(text):
        assert find(name) or (path.parent / name).is_file(), f"there is no {name}"
    for target in LINK.findall(text):
        if "://" in target:
            continue
        file, _, anchor = target.partition("#")
        goal = path.parent / unquote(file) if file else path
        assert goal.exists(), f"there is no {target}"
        if anchor:
            assert anchor in anchors(goal), f"{relative(goal)} has no heading for #{anchor}"


def anchors(path):
    """The anchors that GitHub gives to the headings of a document, and those of what a page shows."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", text_of(path)), re.MULTILINE)
    own = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return own | {anchor[1:] for (_, anchor), page in pages()["shown_where"]().items() if page == path.resolve()}


@cache
def pages():
    return runpy.run_path(str(REPOSITORY / "docs" / "_ext" / "repository_files.py"))


def commands():
    """Every drake-tracker command line in the README, in code blocks and in running text."""
    found = COMMAND.findall(text_of(README))
    for block in blocks(README, ""):
        found += [line.split("#")[0].strip() for line in block.splitlines() if line.startswith("drake-tracker ")]
    return sorted({line for line in found if "…" not in line})


def subparsers():
    (action,) = (a for a in cli._parser()._actions if isinstance(a, argparse._SubParsersAction))
    return action.choices


@pytest.fixture(scope="module")
def guide_files(tmp_path_factory):
    """A folder with the files that the guides show."""
    folder = tmp_path_factory.mktemp("guides")
    for guide in GUIDES:
        for _, body in guide_blocks(guide):
            write_file(body, folder)
    path, before = list(sys.path), set(sys.modules)
    yield folder
    sys.path[:] = path
    for name in set(sys.modules) - before:
        if str(folder) in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


@pytest.mark.parametrize("line", commands())
def test_command_is_understood(line, guide_files, monkeypatch):
    monkeypatch.chdir(guide_files)
    _, *arguments = shlex.split(line)
    options = cli._parser().parse_args(arguments)
    scenario = getattr(options, "scenario", None)
    if scenario and not scenario.endswith(".yaml"):  # the user's own files are in the test of YAML blocks
        load_scenario(scenario, getattr(options, "seed", None), None, getattr(options, "overrides", ()))


def test_every_command_and_every_option_of_run_is_told():
    text = text_of(README)
    told = {line.split()[1] for line in commands()}
    assert told == set(subparsers())
    for action in subparsers()["run"]._actions:
        for option in action.option_strings:
            assert option in ("-h", "--help") or f"`{option}" in text, f"the README does not tell of {option}"


def test_the_exit_codes_told_are_the_programs():
    sentence = " ".join(re.search(r"Exit codes: (.+?)\n\n", text_of(README), re.DOTALL).group(1).split())
    assert re.findall(r"\b(\d) (the train was lifted|it was not|bad input)", sentence) == [
        (str(common.SUCCESS), "the train was lifted"),
        (str(common.NOT_TAKEN), "it was not"),
        (str(common.TROUBLE), "bad input"),
    ]


@pytest.mark.parametrize("path", DOCUMENTS, ids=relative)
def test_make_targets_exist(path):
    targets = set(re.findall(r"^([\w-]+):", text_of(REPOSITORY / "Makefile"), re.MULTILINE))
    named = re.findall(r"(?:^|`)make ([a-z-]+)", text_of(path), re.MULTILINE)
    assert set(named) <= targets


@pytest.mark.parametrize("path", [README, REPOSITORY / "benchmarks" / "README.md"], ids=relative)
def test_scripts_named_exist_and_know_their_options(path):
    lines = re.findall(r"`python ((?:benchmarks|docs)/[^`]+)`", text_of(path))
    assert lines
    for line in lines:
        script, *arguments = shlex.split(line)
        source = text_of(REPOSITORY / script)
        for option in (argument for argument in arguments if argument.startswith("--")):
            assert f'"{option}"' in source, f"{script} has no {option}"


def test_cells_named_are_those_of_the_benchmark():
    cells = runpy.run_path(str(REPOSITORY / "benchmarks" / "train_grasp.py"))["CELLS"]
    (table,) = re.findall(r"<!-- numbers: train_grasp -->\n(.*?)<!-- end -->", text_of(README), re.DOTALL)
    assert [row.split("|")[1].strip() for row in table.splitlines()[2:]] == list(cells)
    for named in re.findall(r"--cells ([^` ]+)", text_of(REPOSITORY / "benchmarks" / "README.md")):
        assert set(named.split(",")) <= set(cells)


@pytest.mark.parametrize("block", blocks(README, "yaml"))
def test_scenarios_of_the_readme_load(block, tmp_path):
    file = tmp_path / f"{block.split(':')[0]}.yaml"
    file.write_text(block, encoding="utf-8")
    load_scenario(str(file))


def test_python_of_the_readme_is_the_packages_own():
    (block,) = blocks(README, "python")
    code = [line.split("#")[0].strip() for line in block.splitlines()]
    assert len(code) == 5
    own = [line.split("#")[0].strip() for line in drake_tracker.__doc__.splitlines()]
    assert all(line in own for line in code)


def test_every_system_is_in_the_reference():
    folders = {path.parent.name for path in (REPOSITORY / "drake_tracker").rglob("*.py")
               if ".. pydrake_system::" in text_of(path)}  # fmt: skip
    reference = REPOSITORY / "docs" / "reference"
    texts = {path.stem: text_of(path) for path in reference.glob("*.rst")}
    shown = {name for text in texts.values() for name in re.findall(r"^\.\. systems:: (\w+)$", text, re.MULTILINE)}
    assert shown == folders
    assert set(texts) <= set(text_of(reference / "index.md").split())


def test_links_of_what_a_page_shows_lead_to_pages():
    shown = pages()["shown_where"]()
    page, path = REPOSITORY / "docs" / "how_to" / "camera.md", README
    links = {"ARCHITECTURE.md#time": "../architecture.md#time", "#your-own-cameras": "#your-own-cameras",
             "#numbers": "../numbers.md#numbers", "docs/images/ball.png": "../images/ball.png",
             "LICENSE": "path:../../LICENSE"}  # fmt: skip
    for link, target in links.items():
        assert pages()["target"](pages()["LINK"].search(f"[x]({link})"), path, page, shown) == target


def test_the_pictures_of_the_tour_name_every_system_and_port():
    graphs = runpy.run_path(str(REPOSITORY / "docs" / "make_diagrams.py"))["graphs"]()
    for name, graph in graphs.items():
        svg = text_of(REPOSITORY / "docs" / "images" / f"{name}.svg")
        picture = re.findall(r"<text[^>]*>([^<]+)</text>", svg)
        drawn = re.findall(r'label="([^"]+)"|<TD PORT[^>]*>([^<]+)<|<B>([^<]+)<|<BR/>([^<]+)<', graph)
        told = sorted("".join(words) for words in drawn)
        assert told == sorted(picture), "python docs/make_diagrams.py draws it anew"


def test_pictures_are_small_and_none_is_left_over():
    pictures = sorted((REPOSITORY / "docs" / "images").iterdir())
    assert sum(path.stat().st_size for path in pictures) < PICTURES_LIMIT
    shown = {Path(target).name for path in DOCUMENTS for target in LINK.findall(text_of(path))}
    assert {path.name for path in pictures} <= shown
