"""Documents and result files say the same, and every result file names its origin."""

import gzip
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from shared.common import percent

REPOSITORY = Path(__file__).parents[2]
RESULTS = REPOSITORY / "benchmarks" / "results"
PAGES = sorted((REPOSITORY / "docs" / "results").glob("*.md"))
ORIGIN = """
import sys
sys.path[:0] = ["docs", "benchmarks"]
from pathlib import Path
from tables.provenance import origin_of
for path in sys.argv[1:]:
    found = origin_of(Path(path))
    assert found.commits and found.seeds and found.versions and found.command
"""
"""In a process of its own: benchmarks/estimation has a module with the same name as the package docs/tables."""


def run(*arguments):
    return subprocess.run([sys.executable, *arguments], cwd=REPOSITORY, capture_output=True, text=True, check=False)


def test_documents_and_results_agree():
    check = run("docs/make_tables.py", "--check")
    assert check.returncode == 0, f"python docs/make_tables.py writes the tables\n{check.stdout}{check.stderr}"


def test_a_changed_number_is_named(tmp_path):
    text = (REPOSITORY / "docs" / "results" / "ball.md").read_text(encoding="utf-8")
    changed = tmp_path / "ball.md"
    changed.write_text(text.replace("60 (98 %)", "61 (100 %)"), encoding="utf-8")
    check = run("docs/make_tables.py", "--check", str(changed))
    assert check.returncode == 1
    assert "ball_cells differs" in check.stdout
    assert "60 (98 %)" in check.stdout
    assert changed.read_text(encoding="utf-8") != text, "--check changes nothing"


def test_every_block_is_on_a_page_and_every_page_is_in_the_contents():
    every = sorted((REPOSITORY / "docs").rglob("*.md"))
    used = {name for page in every for name in re.findall(r"<!-- table: (\S+) -->", page.read_text(encoding="utf-8"))}
    listing = run("docs/make_tables.py", "--print", "?").stderr
    assert used == set(re.search(r"there are (.+)", listing)[1].split(", "))
    contents = (REPOSITORY / "docs" / "results" / "index.md").read_text(encoding="utf-8")
    assert {page.stem for page in PAGES} - {"index"} == set(re.findall(r"^(\w+)$", contents, re.MULTILINE))


def result_files():
    names = {path.name.removesuffix(".gz") for path in RESULTS.glob("*.json*")}
    return [RESULTS / name for name in sorted(names) if not name.endswith(".meta.json")]


def test_every_result_file_names_commit_seeds_versions_and_command():
    check = run("-c", ORIGIN, *map(str, result_files()))
    assert check.returncode == 0, check.stderr


@pytest.mark.parametrize("missing", ["git_commit", "seed", "package_versions"])
def test_a_line_without_its_origin_is_refused(missing, tmp_path):
    line = json.loads(gzip.decompress((RESULTS / "ball.jsonl.gz").read_bytes()).splitlines()[0])
    del line[missing]
    (tmp_path / "made_up.jsonl").write_text(json.dumps(line) + "\n", encoding="utf-8")
    check = run("-c", ORIGIN, str(tmp_path / "made_up.jsonl"))
    assert check.returncode != 0
    assert "made_up.jsonl: no" in check.stderr


def test_new_results_carry_their_origin(tmp_path):
    code = (
        "import sys; sys.path.insert(0, 'benchmarks')\n"
        "from shared.common import save_json\n"
        f"save_json({{'time': 1.0}}, {str(tmp_path / 'one.json')!r}, [3])\n"
        f"save_json([{{'time': 1.0}}], {str(tmp_path / 'several.json')!r}, [3])\n"
    )
    made = run("-c", code)
    assert made.returncode == 0, made.stderr
    one, several = (json.loads((tmp_path / f"{name}.json").read_text(encoding="utf-8")) for name in ("one", "several"))
    for result in (one, several[0]):
        assert result["time"] == 1.0
        assert result["made_by"]["seeds"] == [3]
        assert result["made_by"]["versions"]["numpy"]
        assert {"commit", "command", "date"} <= set(result["made_by"])
        assert result["made_by"]["commit"] or not (REPOSITORY / ".git").exists()


@pytest.mark.parametrize(
    ("part", "text"),
    [(0.0, "0 %"), (1 / 5000, "0.02 %"), (0.004, "0.4 %"), (0.006, "1 %"), (0.5, "50 %"), (0.994, "99 %")]
    + [(239 / 240, "99.6 %"), (4999 / 5000, "99.98 %"), (1.0, "100 %"), (None, "")],
)
def test_only_all_are_100_percent_and_only_none_0(part, text):
    assert percent(part) == text


def test_no_line_of_a_page_is_taken_for_a_comment():
    for page in PAGES:
        lines = page.read_text(encoding="utf-8").splitlines()
        assert not [line for line in lines if line.startswith("%")], f"{page.name}: MyST hides lines that begin with %"


def result_lines():
    """Yields (file name, line number, row) of every published run of an arm."""
    for path in RESULTS.glob("*.jsonl.gz"):
        for number, line in enumerate(gzip.decompress(path.read_bytes()).splitlines(), 1):
            row = json.loads(line)
            if row.get("speed_share") is not None:
                yield path.name, number, row


def test_no_published_run_breaks_a_limit_of_the_arm():
    rows = list(result_lines())
    assert len(rows) > 1000
    broken = [
        (name, row.get("fault"), row.get("vision"), row["seed"])
        for name, _, row in rows
        if row["speed_share"] > 1.0
        or row["longest_saturation_s"] > 0.030 + 1e-6
        or row["joint_limit_margin_rad"] < 0.0
        or any(row.get(key) for key in ("table_touched", "board_touched", "self_touched"))
    ]
    # Of the pairs of faults, one saturated a drive for 37 ms. The table names it.
    assert broken == [("faults.jsonl.gz", "calibration + second-mover", "measured", 921)]
