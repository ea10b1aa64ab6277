"""The scripts by which bash, zsh and fish complete the command line: pure.

Written here and not by a library: those there are leave out options that the help does not show.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from quadriga.commands.completed_words import CompletedCommand, CompletedOption

_BASH: Final = """\
# quadriga: completion for bash
_quadriga() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}}
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W {commands} -- "$cur"))
    return
  fi
  case "${{COMP_WORDS[1]}} $prev" in
{values}
  esac
  case "${{COMP_WORDS[1]}}" in
{words}
  esac
}}
complete -o filenames -F _quadriga quadriga
"""
_ZSH: Final = """\
#compdef quadriga
# quadriga: completion for zsh
_quadriga() {{
  local -a found
  if (( CURRENT == 2 )); then
    found=({commands})
    _describe command found
    return
  fi
  case "$words[2] $words[CURRENT-1]" in
{values}
  esac
  case "$words[2]" in
{words}
  esac
}}
compdef _quadriga quadriga
"""


def write_bash(commands: Sequence[CompletedCommand]) -> str:
    """The script for bash."""
    values, words = list[str](), list[str]()
    for command in commands:
        for option in command.options:
            if option.takes_value:
                pattern = _pattern(command, option)
                values.append(f"    {pattern}) {_bash_reply(option.values, option.is_path)} ;;")
        names = [name for option in command.options for name in option.names]
        listed = f'COMPREPLY=($(compgen -W {_quote(" ".join(names))} -- "$cur"))'
        free = _bash_reply(command.values, command.takes_path)
        words.append(f"    {command.name}) if [[ $cur == -* ]]; then {listed}; else {free}; fi ;;")
    every = _quote(" ".join(command.name for command in commands))
    return _BASH.format(commands=every, values="\n".join(values), words="\n".join(words))


def write_zsh(commands: Sequence[CompletedCommand]) -> str:
    """The script for zsh."""
    values, words = list[str](), list[str]()
    for command in commands:
        for option in command.options:
            if option.takes_value:
                reply = _zsh_reply(option.values, option.is_path)
                values.append(f"    {_pattern(command, option)}) {reply}; return ;;")
        listed = " ".join(
            _quote(f"{name}:{option.doc}") for option in command.options for name in option.names
        )
        free = _zsh_reply(command.values, command.takes_path)
        shown = f"found=({listed}); _describe option found"
        words.append(
            f"    {command.name}) if [[ $PREFIX == -* ]]; then {shown}; else {free}; fi ;;"
        )
    every = " ".join(_quote(f"{command.name}:{command.doc}") for command in commands)
    return _ZSH.format(commands=every, values="\n".join(values), words="\n".join(words))


def write_fish(commands: Sequence[CompletedCommand]) -> str:
    """The script for fish."""
    lines = ["# quadriga: completion for fish", "complete -c quadriga -f"]
    for command in commands:
        first = "-n __fish_use_subcommand"
        doc = _fish_quote(command.doc)
        lines.append(f"complete -c quadriga {first} -a {command.name} -d {doc}")
        lines += _fish_command(command)
    return "\n".join(lines) + "\n"


def _fish_command(command: CompletedCommand) -> Iterator[str]:
    begin = f"complete -c quadriga -n '__fish_seen_subcommand_from {command.name}'"
    if command.values:
        yield f"{begin} -a {_fish_quote(' '.join(command.values))}"
    if command.takes_path:
        yield f"{begin} -F"
    for option in command.options:
        spelled = " ".join(
            f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in option.names
        )
        value = ""
        if option.takes_value:
            value = " -r -F" if option.is_path else " -x"
            value += f" -a {_fish_quote(' '.join(option.values))}" if option.values else ""
        yield f"{begin} {spelled}{value} -d {_fish_quote(option.doc)}"


def _pattern(command: CompletedCommand, option: CompletedOption) -> str:
    """What a case is of: the command and the option before the word that is completed."""
    return "|".join(f'"{command.name} {name}"' for name in option.names)


def _bash_reply(values: Sequence[str], is_path: bool) -> str:
    if not values and not is_path:
        return "return"
    words = f"-W {_quote(' '.join(values))} " if values else ""
    return f'COMPREPLY=($(compgen {words}{"-f " if is_path else ""}-- "$cur")); return'


def _zsh_reply(values: Sequence[str], is_path: bool) -> str:
    added = [f"compadd -- {' '.join(map(_quote, values))}"] if values else []
    return "; ".join([*added, *(["_files"] if is_path else [])]) or ":"


def _quote(text: str) -> str:
    """For bash and zsh."""
    return "'" + text.replace("'", "'\\''") + "'"


def _fish_quote(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


WRITERS: Final[Mapping[str, Callable[[Sequence[CompletedCommand]], str]]] = MappingProxyType(
    {"bash": write_bash, "zsh": write_zsh, "fish": write_fish}
)
