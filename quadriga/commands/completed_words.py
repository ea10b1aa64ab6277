"""What can stand where on the command line, read from its parser, for a shell that completes it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.commands.options import named_path, recording_path

_MORE: Final = "…"  # in a placeholder: other values are possible
_PATHS: Final = (named_path, recording_path)
_SEVERAL: Final = "|"  # between the values of a placeholder


@dataclass(frozen=True, slots=True)
class CompletedOption:
    """An option of a command.

    Attributes:
        names: as typed.
        doc: what it is for, in a line.
        takes_value: whether a value follows it.
        values: that may follow it, as far as they can be listed.
        is_path: whether the value is a file or a folder.
    """

    names: tuple[str, ...]
    doc: str
    takes_value: bool
    values: tuple[str, ...]
    is_path: bool


@dataclass(frozen=True, slots=True)
class CompletedCommand:
    """A command.

    Attributes:
        name: as typed.
        doc: what it does, in a line.
        options: its own, and those of the configuration.
        values: that may follow it without an option, as far as they can be listed.
        takes_path: whether a file or a folder may.
    """

    name: str
    doc: str
    options: tuple[CompletedOption, ...]
    values: tuple[str, ...]
    takes_path: bool


def list_commands(
    parsers: Mapping[str, argparse.ArgumentParser], names: Mapping[str, Sequence[str]]
) -> tuple[CompletedCommand, ...]:
    """All commands in the order of the help.

    Args:
        parsers: of each command, with the help of all of its options.
        names: more values, of an option or a command by its name, that the parser does not know.
    """
    return tuple(_describe(name, parser, names) for name, parser in parsers.items())


def _describe(
    command: str, parser: argparse.ArgumentParser, names: Mapping[str, Sequence[str]]
) -> CompletedCommand:
    options, values, takes_path = list[CompletedOption](), list[str](), False
    for action in parser._actions:
        if action.option_strings and action.help != argparse.SUPPRESS:
            options.append(_describe_option(action, names))
        elif not action.option_strings:
            values += _values_of(action)
            takes_path = takes_path or action.type in _PATHS
    values += names.get(command, ())
    doc = parser.description or ""
    return CompletedCommand(command, doc, tuple(options), tuple(values), takes_path)


def _describe_option(
    action: argparse.Action, names: Mapping[str, Sequence[str]]
) -> CompletedOption:
    spelled = tuple(action.option_strings)
    values = [*_values_of(action), *(value for name in spelled for value in names.get(name, ()))]
    doc = " ".join((action.help or "").replace("%(default)s", str(action.default)).split())
    is_path = action.type in _PATHS
    takes_value = action.nargs != 0
    return CompletedOption(spelled, doc.replace("%%", "%"), takes_value, tuple(values), is_path)


def _values_of(action: argparse.Action) -> list[str]:
    """The values that the parser knows, or that stand in the placeholder."""
    if action.choices is not None:
        return [str(choice) for choice in action.choices]
    if isinstance(action.metavar, str) and _SEVERAL in action.metavar:
        return [word for word in action.metavar.split(_SEVERAL) if word.islower() and word != _MORE]
    return []
