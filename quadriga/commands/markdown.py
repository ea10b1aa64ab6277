"""The command line as a page of the manual: `python -m quadriga.commands.markdown`."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from typing import Final

from quadriga.commands.command_table import GROUPS
from quadriga.commands.config_options import build_config_options
from quadriga.commands.parser import build_parser, takes

_HEAD: Final = """\
# Command line

`quadriga COMMAND`. Every command that has a configuration reads one: defaults, then `--scenario`,
then `--config`, then [options that set keys](#options-of-the-configuration). A user's mistake costs
one line on stderr.

| exit status | meaning |
|---|---|
| 0 | done; of a walk: every robot walked to the end, or until somebody stopped it |
| 1 | a robot fell or stopped, a process failed, or what was to be checked is not so |
| 2 | the command, the configuration or a file is wrong |
| 130 | interrupted |

This page is generated: `make docs`, or `python -m quadriga.commands.markdown >
docs/reference/command_line.md`.
"""
_CONFIGURATION: Final = """\

## Options of the configuration

Of every command that reads a configuration; `quadriga COMMAND --help-all` shows them.
[configuration.md](../configuration.md) has all keys.

"""
_CONNECTING: Final = "record"  # a command that has all of them, `--connect` too
_SIGNS: Final = re.compile(r"([|*<$])")
_BAR: Final = "\\|"


def to_markdown() -> str:
    """The page: all commands in their groups, each with its options, then those of all."""
    return "".join((_HEAD, *_describe_groups(), _CONFIGURATION, *_describe_configuration()))


def _describe_groups() -> Iterator[str]:
    parsers = build_parser().commands
    for title, names in _names_by_group().items():
        yield f"\n## {title[0].upper()}{title[1:]}\n"
        for name in names:
            yield from _describe_command(parsers[name])


def _names_by_group() -> dict[str, list[str]]:
    """The commands of each group of the help, in its order."""
    names: dict[str, list[str]] = {}

    def note(name: str, _run: object, _doc: str) -> argparse.ArgumentParser:
        names[title].append(name)
        return argparse.ArgumentParser()

    for title, adds in GROUPS.items():
        names[title] = []
        for add in adds:
            add(note)
    return names


def _describe_command(parser: argparse.ArgumentParser) -> Iterator[str]:
    name = parser.prog.rpartition(" ")[2]
    shown = [action for action in parser._actions if action.help != argparse.SUPPRESS]
    own = [action for action in shown if not isinstance(action, argparse._HelpAction)]
    places = [takes(action) for action in own if not action.option_strings]
    options = ["[options]"] * any(action.option_strings for action in own)
    yield f"\n### {name}\n\n"
    yield f"`{' '.join(('quadriga', name, *options, *places))}` – {parser.description}.\n"
    if own:
        yield "\n| | |\n|---|---|\n"
        yield from (_row(parser, action) for action in own)
    if parser.epilog:
        yield f"\n{_escape(parser.epilog)}\n"


def _describe_configuration() -> Iterator[str]:
    parser = build_config_options(_CONNECTING, hidden=False)
    shown = (action for action in parser._actions if action.help != argparse.SUPPRESS)
    yield "| option | |\n|---|---|\n"
    yield from (_row(parser, action) for action in shown)


def _row(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    """A row of a table: the option or place with what it takes, and its help."""
    value = "" if action.nargs == 0 else takes(action)
    name = " ".join(filter(None, (", ".join(action.option_strings), value)))
    text = parser._get_formatter()._expand_help(action) if action.help else ""
    return f"| `{name.replace('|', _BAR)}` | {_escape(text)} |\n"


def _escape(text: str) -> str:
    """Text of a cell in Markdown: what is not code means nothing but itself."""
    parts = text.split("`")
    parts[0::2] = [_SIGNS.sub(r"\\\1", part) for part in parts[0::2]]
    parts[1::2] = [part.replace("|", _BAR) for part in parts[1::2]]
    return "`".join(parts)


if __name__ == "__main__":
    print(to_markdown(), end="")
