"""One setting of a scenario: a dataclass field that knows its unit, what is allowed and what it means."""

import copy
import dataclasses


def setting(default, help, unit="", range=None, choices=None, shape=None):
    """Declares a setting as a dataclass field.

    Args:
        default: value, or a class (a nested part, built with its own defaults). A list or dict is copied for each
            instance.
        help: one line, what the setting does.
        unit: unit of a number, empty when it has none.
        range: lowest and highest allowed number, both included; of every element when the setting is a list.
        choices: the allowed words, when it is one of a few.
        shape: length of a list as (n,), or rows and columns of a list of lists as (m, n); None rows: any number.
    """
    metadata = {"help": help, "unit": unit, "range": range, "choices": choices, "shape": shape}
    if isinstance(default, type):
        return dataclasses.field(default_factory=default, metadata=metadata)
    if isinstance(default, (list, dict)):
        return dataclasses.field(default_factory=lambda: copy.deepcopy(default), metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def allowed(metadata, noun):
    """Returns what a setting allows, in words: "a number from 0 to 1 m/s", "one of oval, circle"."""
    if metadata.get("choices"):
        return "one of " + ", ".join(metadata["choices"])
    text = noun
    if metadata.get("range"):
        low, high = metadata["range"]
        text += f" from {low} to {high}" if isinstance(high, int) else f" from {low:g} to {high:g}"
    return f"{text} {metadata['unit']}" if metadata.get("unit") else text
