"""Measures how many small errors in the package the tests notice.

    python benchmarks/mutations.py                       4 mutations of each of 15 packages
    python benchmarks/mutations.py --packages grasp --each 20 --seed 7

A mutation exchanges one operator: of a comparison, of arithmetic, ``and`` for ``or``, or it removes a ``not``. Each is
made in a clone of the commit, and the tests of the same package run until the first that fails. Seeds draw the places,
so that the same commit has the same mutations. A mutation survives if all these tests pass: some survivors change
nothing that can be observed. The tests of a mutation end after `LONGEST`; a test that does not end counts as killed.
"""

import argparse
import ast
import os
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

from shared.common import print_table, save_json

REPOSITORY = Path(__file__).parents[1]
PACKAGES = ("arm", "calibration", "cameras", "campaign", "dispatch", "environments", "estimation", "faults", "footage")
PACKAGES = (*PACKAGES, "grasp", "link", "network", "own_cameras", "vision", "world")
LONGEST = 300.0
"""Time [s] after which the tests of a mutation are stopped."""
EXCHANGED = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
"""{operator: the operator that replaces it}."""


def mutated(node):
    """Returns an expression with its operator exchanged, None where there is nothing to exchange."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        return node.operand
    if isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in EXCHANGED:
        operator = EXCHANGED[type(node.op)]()
        if isinstance(node, ast.BinOp):
            return ast.BinOp(node.left, operator, node.right)
        return ast.BoolOp(operator, node.values)
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in EXCHANGED:
        return ast.Compare(node.left, [EXCHANGED[type(node.ops[0])]()], node.comparators)
    return None


def mutations_of(package):
    """Returns (path of the file, its text with a mutation, line, expression before, expression after) of all places."""
    found = []
    for path in sorted((REPOSITORY / "drake_tracker" / package).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        starts = [0]
        for line in text.splitlines(keepends=True):
            starts.append(starts[-1] + len(line))
        for node in ast.walk(ast.parse(text)):
            changed = mutated(node)
            # In f-strings, Python 3.11 does not know the places of expressions.
            segment = ast.get_source_segment(text, node) if changed is not None and text.isascii() else None
            if segment is None or not _is_source_of(node, segment):
                continue
            first = starts[node.lineno - 1] + node.col_offset
            last = starts[node.end_lineno - 1] + node.end_col_offset
            after = ast.unparse(changed)
            new = f"{text[:first]}({after}){text[last:]}"
            found.append((path.relative_to(REPOSITORY), new, node.lineno, ast.unparse(node), after))
    return found


def _is_source_of(node, segment):
    try:
        return ast.dump(ast.parse(f"({segment})", mode="eval").body) == ast.dump(node)
    except SyntaxError:
        return False


def run_tests(clone, package, mutation):
    """Makes a mutation in a clone and runs the tests of its package. Returns the row of the results."""
    path, text, line, before, after = mutation
    original = (clone / path).read_text(encoding="utf-8")
    (clone / path).write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "--no-header", f"tests/{package}"]
    environment = {**os.environ, "PYTHONPATH": str(clone), "OPENBLAS_NUM_THREADS": "1"}
    try:
        ended = subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True, timeout=LONGEST)
        failed = [said for said in ended.stdout.splitlines() if said.startswith(("FAILED", "ERROR"))]
        killed, by = ended.returncode != 0, failed[0].split(" - ")[0] if failed else ""
    except subprocess.TimeoutExpired:
        killed, by = True, f"no end within {LONGEST:g} s"
    finally:
        (clone / path).write_text(original, encoding="utf-8")
    print(f"{'killed' if killed else 'SURVIVED'}: {path}:{line} {before} -> {after}", flush=True)
    return {"package": package, "file": str(path), "line": line, "before": before, "after": after} | {
        "killed": killed,
        "by": by,
    }


def mutations_table(rows):
    """Returns (header, rows): killed mutations of each package, and the places of the others."""
    lines = []
    for package in dict.fromkeys(row["package"] for row in rows):
        own = [row for row in rows if row["package"] == package]
        alive = [
            f"`{row['file'].removeprefix('drake_tracker/')}`: `{row['before']}`" for row in own if not row["killed"]
        ]
        lines.append([package, len(own), sum(row["killed"] for row in own), "; ".join(alive).replace("|", "\\|")])
    lines.append(["all", len(rows), sum(row["killed"] for row in rows), ""])
    return ["package", "mutations", "killed", "survivors"], lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--packages", default=",".join(PACKAGES), help="names separated by commas")
    parser.add_argument("--each", type=int, default=4, help="mutations of each package (default 4)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument("--json", type=Path, help="file for the results")
    options = parser.parse_args()
    jobs = []
    for package in options.packages.split(","):
        places = mutations_of(package)
        drawn = random.Random(f"{options.seed} {package}").sample(places, min(options.each, len(places)))
        jobs += [(package, mutation) for mutation in drawn]
    with tempfile.TemporaryDirectory() as folder:
        clones = Queue()
        for number in range(options.workers):
            clone = Path(folder) / str(number)
            subprocess.run(["git", "clone", "-q", str(REPOSITORY), str(clone)], check=True)
            clones.put(clone)

        def work(job):
            clone = clones.get()
            try:
                return run_tests(clone, *job)
            finally:
                clones.put(clone)

        with ThreadPoolExecutor(options.workers) as pool:
            rows = list(pool.map(work, jobs))
    print_table(*mutations_table(rows))
    save_json({"rows": rows}, options.json, [options.seed])


if __name__ == "__main__":
    main()
