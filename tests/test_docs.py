"""The documents are true and readable: what they point at exists, and they keep to their sizes and their words."""

import argparse
import ast
import json
import re
import runpy
import shlex
import sys
from functools import cache
from pathlib import Path
from urllib.parse import unquote

import pexpect
import pytest
from guides import GUIDES, RUNNABLE, write_file
from guides import blocks as guide_blocks

import drake_tracker
from drake_tracker import cli
from drake_tracker.commands import common
from drake_tracker.core.processes.signals import REQUESTS
from drake_tracker.tasks import load_scenario

REPOSITORY = Path(__file__).parents[1]
DOCS = REPOSITORY / "docs"
README = REPOSITORY / "README.md"
ARCHITECTURE = REPOSITORY / "ARCHITECTURE.md"
COMMANDS = DOCS / "reference" / "commands.md"
NOTEBOOKS = sorted((REPOSITORY / "notebooks").glob("*.ipynb"))
PAGES = sorted(path for suffix in ("md", "rst") for path in DOCS.rglob(f"*.{suffix}") if "_build" not in path.parts)
DOCUMENTS = [
    *sorted(REPOSITORY.glob("*.md")),
    *sorted(REPOSITORY.glob("benchmarks/*.md")),
    *sorted(REPOSITORY.glob("models/*/README.md")),
    *(page for page in PAGES if page.suffix == ".md"),
]
LARGEST = {README: 9_000, ARCHITECTURE: 18_500}
"""Size of a document [bytes]."""
PICTURES_LIMIT = 4_000_000
"""Size of all pictures together [bytes]."""
GRASP_LIMIT = 2_000_000
"""Size of the animated picture [bytes]."""

POINTER = re.compile(r"`([\w/]+\.py)::([\w.]+)`")
FILE = re.compile(r"`([\w./-]+/[\w.-]+\.(?:py|yaml|md|sdf|ipynb))`")
LINK = re.compile(r"\]\(([^)\s]+)\)")
FENCE = re.compile(r"^```(\{?[\w-]*\}?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"`(drake-tracker [^`]+)`")
PLACEHOLDER = re.compile(r"…|\b(?:FILE|DIR|RUN|SCENARIO|COMMAND|NAME|TASK|BAG|URL|N)\b")
"""A command with one of these is a pattern, which cannot be parsed."""
UNIDIOMATIC = [
    r"rooms?",
    r"stor(?:ey|eys|ies)",
    r"wild points?",
    r"of one's own",
    r"comes? round",
    r"(?:has|have) come round",
    r"hangs? (?:on|together)",
    r"whoever",
    r"vouch(?:es)?",
    r"believed",
    r"fores(?:ee|ees|een|aw)",
    r"readings",
    r"a reading",
    r"the way driven",
    r"in whatever order",
    r"is told of",
]
"""Expressions that no native speaker of the field would use; style has the idiomatic ones."""


def relative(path):
    return path.relative_to(REPOSITORY).as_posix()


def text_of(path):
    """The text of a document; of a notebook, its Markdown."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        return "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return text


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


@pytest.mark.parametrize("path", list(LARGEST), ids=relative)
def test_document_is_short(path):
    assert path.stat().st_size <= LARGEST[path], "move details to docs/"


@pytest.mark.parametrize(
    "path", [path for path in (*DOCUMENTS, *NOTEBOOKS) if path.name != "CHANGELOG.md"], ids=relative
)
def test_english_is_idiomatic(path):
    text = re.sub(r"`[^`]*`", "", FENCE.sub("", text_of(path)))
    found = [match[0] for words in UNIDIOMATIC for match in re.finditer(rf"\b{words}\b", text, re.IGNORECASE)]
    assert not found


@pytest.mark.parametrize("path", [path for path in DOCUMENTS if POINTER.search(text_of(path))], ids=relative)
def test_what_a_pointer_names_is_defined(path):
    missing = []
    for file, name in sorted(set(POINTER.findall(text_of(path)))):
        module = find(file)
        if module is None or name not in names_in(module):
            missing.append(f"{file}::{name}")
    assert not missing


def test_every_equation_and_step_of_the_paper_is_in_the_table():
    table = text_of(DOCS / "explanation" / "papers_to_code.md").split("## Allen")[1].split("\n## ")[0]
    first = " ".join(row.split("|")[1] for row in table.splitlines() if row.startswith("|"))
    assert {int(number) for number in re.findall(r"\((\d+)\)", first)} == set(range(1, 22))
    steps = set()
    for low, high in re.findall(r"steps? (\d+)(?:-(\d+))?", first):
        steps |= set(range(int(low), int(high or low) + 1))
    assert steps == set(range(1, 12))
    for part in ("figure 11", "appendix C", "section 4.3", "section 4.4", "section 5"):
        assert part in first, part


@pytest.mark.parametrize("path", [*DOCUMENTS, *NOTEBOOKS], ids=relative)
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
    """The anchors that GitHub gives to the headings of a document."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", text_of(path)), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def commands():
    """Every drake-tracker command line in the documents, in code blocks and in running text."""
    found = set()
    for path in [*DOCUMENTS, *NOTEBOOKS]:
        if path.name == "CHANGELOG.md":
            continue
        text = text_of(path)
        lines = COMMAND.findall(FENCE.sub("", text))
        for language, block in FENCE.findall(text):
            if language in ("", "bash", "sh"):
                block = block.replace("\\\n", " ")
                lines += [line.split(" #")[0] for line in block.splitlines() if line.startswith("drake-tracker ")]
        found |= {" ".join(re.split(r"\s\\?\|\s", line)[0].split()) for line in lines}
    return sorted(line for line in found if not PLACEHOLDER.search(line.replace("HOST:PORT", "a:1")))


def subparsers():
    (action,) = (a for a in cli.make_parser()._actions if isinstance(a, argparse._SubParsersAction))
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


def test_an_interactive_shell_hands_every_command_to_the_program_unchanged(tmp_path):
    """In a pseudo-terminal, where bash expands its history. The commands do not run: a function prints their words."""
    lines = commands()
    assert len(lines) > 80
    shell = pexpect.spawn(
        "bash", ["--norc", "--noprofile", "-i"], cwd=str(tmp_path), encoding="utf-8", echo=False, timeout=20
    )
    shell.delaybeforesend = None
    shell.sendline("PS1=; drake-tracker() { printf '%s\\0' drake-tracker \"$@\" >> words; printf '\\n' >> words; }")
    for number, line in enumerate(lines):
        shell.sendline(f"{line}; echo done-$(({number}+0))")
        shell.expect_exact(f"done-{number}\r\n")
    shell.close()
    handed = (tmp_path / "words").read_text(encoding="utf-8").split("\0\n")[:-1]
    for line, words in zip(lines, handed, strict=True):
        assert words.split("\0") == shlex.split(line)


@pytest.mark.parametrize("line", commands())
def test_command_is_understood(line, guide_files, monkeypatch):
    monkeypatch.chdir(guide_files)
    _, *arguments = shlex.split(line)
    if not arguments or (len(arguments) == 1 and arguments[0] in subparsers()):
        return  # the name of a command
    if arguments[1:] == ["--help"]:
        assert arguments[0] in subparsers()
        return
    options = cli.make_parser().parse_args(arguments)
    scenario = getattr(options, "scenario", None)
    if scenario and not scenario.endswith(".yaml"):  # the user's own files are tested where they are shown
        load_scenario(scenario, getattr(options, "seed", None), None, getattr(options, "overrides", ()))


def test_every_command_is_in_the_reference():
    text = text_of(COMMANDS)
    headings = re.findall(r"^## ([a-z-]+)$", text, re.MULTILINE)
    assert headings == [*re.findall(r"^\.\. options:: (\S+)$", text, re.MULTILINE), "doctor"]
    assert {*headings} == {*subparsers()}


def test_the_exit_codes_in_the_reference_are_those_of_the_program():
    rows = dict(re.findall(r"^\| (\d+) \| (.+) \|$", text_of(COMMANDS), re.MULTILINE))
    codes = {
        common.SUCCESS: "the train was lifted",
        common.NOT_TAKEN: "without a success",
        common.TROUBLE: "invalid input",
        common.FAULT: "internal error",
        **{128 + signum: "interrupted" for signum in REQUESTS},
        common.BROKEN_PIPE: "output",
    }
    assert set(rows) == {str(code) for code in codes}
    for code, words in codes.items():
        assert words in rows[str(code)]


@pytest.mark.parametrize("path", DOCUMENTS, ids=relative)
def test_make_targets_exist(path):
    targets = set(re.findall(r"^([\w-]+):", text_of(REPOSITORY / "Makefile"), re.MULTILINE))
    named = re.findall(r"(?:^|`)make ([a-z-]+)", text_of(path), re.MULTILINE)
    assert set(named) <= targets


@pytest.mark.parametrize("path", [path for path in DOCUMENTS if "`python benchmarks/" in text_of(path)], ids=relative)
def test_scripts_named_exist_and_know_their_options(path):
    for line in re.findall(
        r"python ((?:benchmarks|docs)/[^`;]+)", " ".join(re.findall(r"`python [^`]+`", text_of(path)))
    ):
        script, *arguments = shlex.split(line)
        source = text_of(REPOSITORY / script)
        if "parts.main(" in source:
            source += text_of(REPOSITORY / "benchmarks" / "shared" / "parts.py")
        for option in (argument for argument in arguments if argument.startswith("--")):
            assert f'"{option}"' in source, f"{script} has no {option}"


def test_cells_named_are_those_of_the_benchmark():
    cells = runpy.run_path(str(REPOSITORY / "benchmarks" / "train_grasp.py"))["CELLS"]
    for path in DOCUMENTS:
        for named in re.findall(r"train_grasp\.py --cells ([^`\s]+)", text_of(path)):
            assert named == "paper" or set(named.split(",")) <= set(cells)


def yaml_blocks():
    """Scenarios in the documents that are not files of a guide."""
    for path in [README, ARCHITECTURE, *(page for page in PAGES if page.suffix == ".md")]:
        yield from (block for block in blocks(path, "yaml") if not block.startswith("# "))


@pytest.mark.parametrize("block", list(yaml_blocks()))
def test_scenarios_in_the_documents_load(block, tmp_path):
    file = tmp_path / f"{block.split(':')[0]}.yaml"
    file.write_text(block, encoding="utf-8")
    load_scenario(str(file))


def test_python_of_the_readme_is_that_of_the_package():
    (block,) = blocks(README, "python")
    code = [line.split("#")[0].strip() for line in block.splitlines() if line]
    assert len(code) == 5
    own = [line.split("#")[0].strip() for line in drake_tracker.__doc__.splitlines()]
    assert all(line in own for line in code)


@pytest.mark.parametrize("path", [path for path in DOCUMENTS if path not in RUNNABLE], ids=relative)
def test_python_in_a_document_compiles(path):
    for block in blocks(path, "python"):
        compile(block, relative(path), "exec")


def test_every_system_is_in_the_reference():
    package = REPOSITORY / "drake_tracker"
    modules = [path for path in package.rglob("*.py") if ".. pydrake_system::" in text_of(path)]
    reference = DOCS / "reference"
    texts = {path.stem: text_of(path) for path in reference.glob("systems/*.rst")}
    shown = {name for text in texts.values() for name in re.findall(r"^\.\. systems:: ([\w/]+)$", text, re.MULTILINE)}
    assert [path for path in modules if not any(path.is_relative_to(package / folder) for folder in shown)] == []
    assert all(any(path.is_relative_to(package / folder) for path in modules) for folder in shown)
    assert {f"systems/{name}" for name in texts} <= set(text_of(reference / "index.md").split())


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent != DOCS], ids=relative)
def test_a_page_is_in_a_table_of_contents(page):
    folder = next(parent for parent in page.parents if (parent / "index.md").is_file())
    name = page.relative_to(folder).with_suffix("").as_posix()
    assert name == "index" or name in text_of(folder / "index.md").split()


@pytest.mark.parametrize(
    ("path", "page", "links"),
    [
        (
            ARCHITECTURE,
            DOCS / "explanation" / "architecture.md",
            {
                "docs/how_to/index.md": "../how_to/index.md",
                "CHANGELOG.md": "../changelog.md",
                "notebooks/01_train.ipynb": "../tutorials/01_train.ipynb",
                "LICENSE": "path:../../LICENSE",
                "https://drake.mit.edu": "https://drake.mit.edu",
            },
        ),
        (
            DOCS / "how_to" / "camera.md",
            DOCS / "how_to" / "camera.md",
            {
                "../../ARCHITECTURE.md#time": "../explanation/architecture.md#time",
                "#try-it": "#try-it",
                "../images/ball.png": "../images/ball.png",
            },
        ),
    ],
    ids=["shown document", "page"],
)
def test_links_of_a_page_lead_to_pages(path, page, links):
    files = runpy.run_path(str(DOCS / "_ext" / "repository_files.py"))
    for link, target in links.items():
        assert files["with_links"](f"[x]({link})", path, page) == f"[x]({target})"


def test_the_diagrams_name_every_system_and_port():
    graphs = runpy.run_path(str(DOCS / "make_diagrams.py"))["graphs"]()
    for name, graph in graphs.items():
        svg = text_of(DOCS / "images" / f"{name}.svg")
        picture = re.findall(r"<text[^>]*>([^<]+)</text>", svg)
        drawn = re.findall(r'label="([^"]+)"|<TD PORT[^>]*>([^<]+)<|<B>([^<]+)<|<BR/>([^<]+)<', graph)
        named = sorted("".join(words) for words in drawn)
        assert named == sorted(picture), "python docs/make_diagrams.py draws it again"


def test_pictures_are_small_and_none_is_left_over():
    pictures = sorted((DOCS / "images").iterdir())
    assert sum(path.stat().st_size for path in pictures) < PICTURES_LIMIT
    assert (DOCS / "images" / "grasp.webp").stat().st_size <= GRASP_LIMIT
    shown = {Path(target).name for path in DOCUMENTS for target in LINK.findall(text_of(path))}
    assert {path.name for path in pictures} <= shown
