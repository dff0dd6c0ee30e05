"""Reads YAML that anybody may have written: plain values only, bounded in depth and in number.

PyYAML's safe loader creates plain values only. But a few lines with aliases can stand for billions of values, deep
nesting exhausts Python's stack, and a wrong value of a standard type ends in a KeyError.
"""

from typing import Any

import yaml

DEEPEST = 32
"""Greatest number of lists and mappings within each other; a scenario needs about five."""
MOST_VALUES = 100_000
"""Greatest number of values, in which an alias counts as often as it is used."""


class BoundedLoader(yaml.SafeLoader):
    """The safe loader of PyYAML, which raises a yaml.MarkedYAMLError where a text exceeds the limits of this module.

    The error is also raised if a value contradicts its tag, such as ``!!bool maybe``.

    Args:
        stream: text to read.
    """

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = self._count = 0
        self._sizes: dict[int, tuple[int, int]] = {}  # id of a node: (number of values in it, its depth)

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Returns the next node, as the composer of PyYAML does."""
        mark = self.peek_event().start_mark
        is_alias, before = self.check_event(yaml.AliasEvent), self._count
        self._depth += 1
        self._check(self._depth, mark)
        node: yaml.Node | None = super().compose_node(parent, index)
        if is_alias:
            if id(node) not in self._sizes:
                raise yaml.composer.ComposerError(None, None, "an alias is within its own value", mark)
            size, depth = self._sizes[id(node)]
            self._check(self._depth + depth - 1, mark)
            self._count += size
        else:
            self._count += 1
            children = [self._sizes.get(id(child), (0, 0))[1] for child in _children(node)]
            self._sizes[id(node)] = (self._count - before, 1 + max(children, default=0))
        self._check(self._depth, mark)
        self._depth -= 1
        return node

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Returns the value of a node, as the constructor of PyYAML does."""
        try:
            return super().construct_object(node, deep)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            kind = node.tag.rpartition(":")[2]
            shown = repr(str(node.value)[:60]) if isinstance(node, yaml.ScalarNode) else "this"
            problem = f"{shown} is not a value of the type !!{kind}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from None

    def _check(self, depth: int, mark: yaml.Mark) -> None:
        if depth > DEEPEST:
            raise yaml.composer.ComposerError(None, None, f"nested too deeply, more than {DEEPEST} levels", mark)
        if self._count > MOST_VALUES:
            raise yaml.composer.ComposerError(None, None, f"more than {MOST_VALUES} values, aliases included", mark)


def _children(node: yaml.Node | None) -> list[yaml.Node]:
    """Returns the nodes that a node contains."""
    if isinstance(node, yaml.MappingNode):
        return [child for pair in node.value for child in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def load_yaml(text: str) -> Any:
    """Returns the plain value of a YAML text.

    Raises yaml.YAMLError when it is not YAML, or exceeds the limits of this module.
    """
    return yaml.load(text, BoundedLoader)
