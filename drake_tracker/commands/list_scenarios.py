"""``drake-tracker list``: lists the scenarios, or every setting of one."""

import dataclasses
import shutil
import textwrap
from argparse import Namespace
from collections.abc import Collection
from typing import Any

from drake_tracker.commands.common import SUCCESS, Commands, add_command, add_overrides

_WIDEST = 110
"""Greatest width of the text, however wide the terminal is."""
_LONGEST_VALUE = 16
"""Longest value that is printed in its column; a longer value has separate lines."""
_NARROWEST = 24
"""Least width of the column of texts; in a narrower terminal they stand below the values."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "list",
        execute,
        help="list the scenarios, or the settings of one",
        description="Lists the scenarios of the package. With a scenario: the settings that people change most, each "
        "with its value, the allowed values, and its meaning.",
        next_step="drake-tracker run SCENARIO --set KEY.PATH=VALUE",
    )
    command.add_argument("scenario", nargs="?", metavar="SCENARIO[:NAME]", help="show the settings of this scenario")
    command.add_argument("--all", action="store_true", help="show every setting")
    add_overrides(command)


def execute(options: Namespace) -> int:
    """Prints the list; returns the exit code."""
    from drake_tracker.tasks import list_scenarios, load_scenario

    width = min(shutil.get_terminal_size().columns, _WIDEST)
    if options.scenario:
        scenario = load_scenario(options.scenario, overrides=options.overrides)
        changed = tuple(override.partition("=")[0].strip() for override in options.overrides)
        lines = settings_lines(scenario, width, None if options.all else (*scenario.COMMON, *changed), changed)
    else:
        lines = scenario_lines(list_scenarios(), width)
    print("\n".join(lines))
    return SUCCESS


def scenario_lines(scenarios: list[tuple[str, str]], width: int) -> list[str]:
    """Returns the lines of the list of scenarios.

    Args:
        scenarios: (name, description) of each.
        width: greatest length of a line [characters].
    """
    indent = max(len(name) for name, _ in scenarios) + 2
    lines = []
    for name, description in scenarios:
        lines += _row(f"{name:<{indent}}", description, indent, width)
    return lines


def settings_lines(
    scenario: Any, width: int, only: Collection[str] | None = None, parts_shown: Collection[str] = ()
) -> list[str]:
    """Returns the lines of the settings of a scenario: a section with a heading for each part.

    Args:
        scenario: the scenario.
        width: greatest length of a line [characters].
        only: key paths of the settings to show; None shows all.
        parts_shown: key paths of parts of which all settings are shown.
    """
    from drake_tracker.core.setting import settings_of
    from drake_tracker.scenarios.reader import describe_settings

    all_rows = describe_settings(scenario)
    below = tuple(f"{part}." for part in parts_shown)
    rows = [row for row in all_rows if only is None or row[0] in only or row[0].startswith(below)]
    parts = {
        field.name: field.metadata["help"]
        for field in settings_of(scenario)
        if dataclasses.is_dataclass(getattr(scenario, field.name))
    }
    general = [row for row in rows if row[0].partition(".")[0] not in parts]
    sections = [(f"{scenario.name}: general settings", general)]
    for part, meaning in parts.items():
        own = [row for row in rows if row[0].partition(".")[0] == part]
        if own:
            sections.append((f"{part}: {meaning}", own))
    lines: list[str] = []
    for heading, section in sections:
        lines += [""] if lines else []
        lines += textwrap.wrap(heading, width, subsequent_indent="  ")
        key_width = max(len(key) for key, *_ in section)
        shown = [len(value) for _, value, *_ in section if len(value) <= _LONGEST_VALUE]
        value_width = max(shown, default=0)
        for key, value, allowed, meaning in section:
            lines += _setting(key, value, f"{allowed}; {meaning}", key_width, value_width, width)
    if len(rows) < len(all_rows):
        lines += ["", f"{len(all_rows) - len(rows)} more settings: --all; those of another kind: --set estimator=..."]
    return lines


def _setting(key: str, value: str, text: str, key_width: int, value_width: int, width: int) -> list[str]:
    """Returns the lines of one setting: key, value and text in columns, as far as the width allows."""
    indent = 2 + key_width + 2
    if width - (indent + value_width + 2) < _NARROWEST:
        return [*_row(f"  {key}  ", value, 4 + len(key), width), *_row(" " * 6, text, 6, width)]
    if len(value) <= value_width:
        return _row(f"  {key:<{key_width}}  {value:<{value_width}}  ", text, indent + value_width + 2, width)
    lines = _row(f"  {key:<{key_width}}  ", value, indent, width)
    return lines + _row(" " * (indent + value_width + 2), text, indent + value_width + 2, width)


def _row(start: str, text: str, indent: int, width: int) -> list[str]:
    """Returns the lines of a text after a start of ``indent`` characters, wrapped with a hanging indent."""
    wrapped = textwrap.wrap(text, max(width - indent, 10), break_on_hyphens=False) or [""]
    return [f"{start}{wrapped[0]}".rstrip(), *(" " * indent + line for line in wrapped[1:])]
