"""``drake-tracker completion``: prints a script that completes commands and options in a shell."""

from argparse import ArgumentParser, Namespace, _SubParsersAction
from collections.abc import Iterator
from functools import partial

from drake_tracker.commands.common import SUCCESS, Commands, add_command

_BASH = """
_drake_tracker_scenarios() { compgen -W "%(scenarios)s" -- "$1"; compgen -f -- "$1"; }
_drake_tracker_settings() { compgen -W "%(settings)s" -- "$1"; }
"""
_BASH_END = """
# Bash splits words at : and =, which are characters of scenario names and settings.
_drake_tracker() {
  local line="${COMP_LINE:0:COMP_POINT}" typed split
  read -ra COMP_WORDS <<< "$line"
  [[ $line == *[[:space:]] ]] && COMP_WORDS+=("")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) typed="${COMP_WORDS[-1]}"
  _shtab_drake_tracker
  split="${typed%%"${typed##*[:=]}"}"
  COMPREPLY=("${COMPREPLY[@]#"$split"}")
  [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace
}
complete -o bashdefault -F _drake_tracker drake-tracker
"""
_ZSH = """
_drake_tracker_scenarios() { compadd -- %(scenarios)s; _files }
_drake_tracker_settings() { compadd -S "" -- %(settings)s }
"""
_FISH = """
function _drake_tracker_scenarios
  printf "%%s\\n" %(scenarios)s
  __fish_complete_path (commandline -ct)
end
function _drake_tracker_settings
  printf "%%s\\n" %(settings)s
end
"""

SHELLS = {
    "bash": "~/.local/share/bash-completion/completions/drake-tracker",
    "zsh": "~/.zfunc/_drake-tracker",
    "fish": "~/.config/fish/completions/drake-tracker.fish",
}
"""Shells, each with the file in which one user installs the script; zsh needs ~/.zfunc in its fpath."""


def register(commands: Commands, root: ArgumentParser) -> None:
    """Adds the command to the parsers ``commands``.

    Args:
        commands: parsers of the commands.
        root: parser of ``drake-tracker``, whose commands and options are completed.
    """
    command = add_command(
        commands,
        "completion",
        partial(execute, root),
        help="print a completion script for a shell",
        description="\n".join(
            ["Prints a script that completes commands, options, scenarios and settings. To install it:"]
            + [f"  drake-tracker completion {shell} > {file}" for shell, file in SHELLS.items()]
        ),
    )
    command.add_argument("shell", choices=list(SHELLS), help="the shell")


def execute(root: ArgumentParser, options: Namespace) -> int:
    """Prints the script; returns the exit code."""
    import shtab

    words = {"scenarios": " ".join(_scenarios()), "settings": " ".join(_settings())}
    preamble = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}[options.shell] % words
    for parser in _parsers(root):
        for action in parser._actions:
            if action.dest in ("scenario", "overrides"):
                function = f"_drake_tracker_{'scenarios' if action.dest == 'scenario' else 'settings'}"
                action.complete = {"bash": function, "zsh": function, "fish": f"({function})"}  # type: ignore[attr-defined]
    print(shtab.complete(root, options.shell, preamble=preamble))
    if options.shell == "bash":
        print(_BASH_END % ())
    return SUCCESS


def _parsers(root: ArgumentParser) -> Iterator[ArgumentParser]:
    """Yields a parser and those of all its commands."""
    yield root
    for action in root._actions:
        if isinstance(action, _SubParsersAction):
            for parser in action.choices.values():
                yield from _parsers(parser)


def _scenarios() -> list[str]:
    from drake_tracker.tasks import list_scenarios

    return [name for name, _ in list_scenarios()]


def _settings() -> list[str]:
    """Returns ``key=`` for the settings of all tasks, and ``key=Kind`` for their parts."""
    from drake_tracker.scenarios.reader import setting_words
    from drake_tracker.tasks.registry import TASKS

    return sorted({word for task in TASKS.values() for word in setting_words(task.scenario)})
