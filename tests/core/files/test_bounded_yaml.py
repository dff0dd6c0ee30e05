"""Tests of the limits of YAML from anybody: depth, number of values, types."""

import pytest
import yaml

from drake_tracker.core.files import bounded_yaml
from drake_tracker.core.files.bounded_yaml import DEEPEST, MOST_VALUES, load_yaml

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n" for before, name in zip("abcdefgh", "bcdefghi")
)
"""Nine lists of nine: 4e8 values in nine lines."""


def test_plain_values_are_read_as_by_the_safe_loader():
    text = "a: [1, 2.5, true, null, 2001-01-01, !!set {x}]\nb: &b {c: d}\ne: *b\nf: {<<: *b, g: h}\n"
    assert load_yaml(text) == yaml.safe_load(text)
    deep = "[" * DEEPEST + "]" * DEEPEST
    assert load_yaml(deep) == yaml.safe_load(deep)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: !!bool maybe", "'maybe' is not a value of the type !!bool"),
        ("a: !!int ''", "'' is not a value of the type !!int"),
        ("a: !!float 1e", "'1e' is not a value of the type !!float"),
        ("a: !!timestamp now", "'now' is not a value of the type !!timestamp"),
        ("a: 2001-99-99", "'2001-99-99' is not a value of the type !!timestamp"),
        ("a: " + ":".join(["59"] * 300) + ".5", "is not a value of the type !!float"),
        ("a: " + "[" * 300 + "]" * 300, "nested too deeply, more than 32 levels"),
        ("\n".join(f"{' ' * k}a:" for k in range(300)), "nested too deeply"),
        (f"a: &a {'[' * 20}{']' * 20}\nb: {'[' * 20}*a{']' * 20}", "nested too deeply"),
        (BOMB, f"more than {MOST_VALUES} values, aliases included"),
        ("a: &a [*a]", "an alias is within its own value"),
        ("a: !!python/object/apply:os.system [true]", "could not determine a constructor"),
        ("a: [", "expected the node content"),
        ("\x07", "special characters are not allowed"),
    ],
)
def test_what_exceeds_a_limit_is_an_error_of_yaml(text, message):
    with pytest.raises(yaml.YAMLError, match=message):
        load_yaml(text)


def test_values_count_without_aliases_too(monkeypatch):
    monkeypatch.setattr(bounded_yaml, "MOST_VALUES", 1000)  # a text of 100,000 values takes seconds to read
    assert load_yaml(f"[{'1, ' * 999}]") == [1] * 999
    for text in (f"[{'1, ' * 1000}]", "- 1\n" * 1000, "".join(f"a{k}: 1\n" for k in range(500))):
        with pytest.raises(yaml.YAMLError, match="more than 1000 values"):
            load_yaml(text)
