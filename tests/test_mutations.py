"""Tests of the small errors that `benchmarks/mutations.py` makes."""

import ast

import mutations
import pytest


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a < b", "a >= b"),
        ("a == b", "a != b"),
        ("a - b", "a + b"),
        ("a * b", "a / b"),
        ("a and b", "a or b"),
        ("not a", "a"),
        ("a < b < c", None),
        ("a is b", None),
        ("a % b", None),
        ("-a", None),
    ],
)
def test_an_operator_is_exchanged(before, after):
    node = mutations.mutated(ast.parse(before, mode="eval").body)
    assert (node if node is None else ast.unparse(node)) == after


def test_each_mutation_changes_one_expression_of_a_file(monkeypatch, tmp_path):
    text = 'def f(a, b):\n    """Returns a - b."""\n    return (a +\n            b) if a < b else f"{a * b}"\n'
    file = tmp_path / "drake_tracker" / "part" / "code.py"
    file.parent.mkdir(parents=True)
    file.write_text(text)
    monkeypatch.setattr(mutations, "REPOSITORY", tmp_path)
    found = mutations.mutations_of("part")
    assert {(line, before, after) for _, _, line, before, after in found} >= {
        (3, "a + b", "a - b"),
        (4, "a < b", "a >= b"),
    }
    for _, changed, _, before, after in found:
        assert ast.unparse(ast.parse(changed)) == ast.unparse(ast.parse(text)).replace(before, after)
