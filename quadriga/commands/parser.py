"""What an operator types: the command line, its commands and their exit statuses."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import takewhile
from typing import Any, Final

from quadriga.commands.command import Run
from quadriga.commands.command_table import GROUPS
from quadriga.commands.config_options import build_config_options, describe_key, read_config
from quadriga.commands.mistakes import check_words, refuse_strays
from quadriga.commands.options import READ_AS
from quadriga.commands.running import registered
from quadriga.shared.errors import ConfigError, ProcessError, QuadrigaError, remedy, system_reason
from quadriga.shared.printable import printable, printable_line
from quadriga.shared.runtime.signals import die_with_parent, interrupt_on_sigterm, kill_if_orphaned

FAILED: Final = 1  # a robot fell or a process failed
WRONG: Final = 2  # the command, the configuration or a file is wrong
INTERRUPTED: Final = 130
_ALL: Final = "--help-all"
_ABOUT: Final = "A team of yoked quadrupeds that walk as one."
_MORE: Final = (
    "`quadriga COMMAND --help` shows the options of a command. Every command reads one\n"
    "configuration: defaults, then --scenario, then --config, then options."
)


class _ShowVersion(argparse.Action):
    """The option that prints the version; to look it up takes 20 ms, so only then."""

    def __init__(self, **named: Any) -> None:
        super().__init__(nargs=0, **named)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it and end."""
        from quadriga.shared.runtime.installed import project_version

        version = project_version()
        print(f"quadriga {version}" if version else "quadriga, from a folder that is not installed")
        parser.exit()


class CommandLine(argparse.ArgumentParser):
    """The parser of the whole command line.

    Attributes:
        commands: the parser of each command by its name, in the order of the help.
    """

    commands: Mapping[str, argparse.ArgumentParser]

    def list_options(self) -> dict[str, tuple[str, ...]]:
        """By command its options, as they are typed."""
        return {name: tuple(list_options(of)) for name, of in self.commands.items()}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; its exit status. A user's mistake costs one line, not a traceback."""
    typed = sys.argv[1:] if argv is None else list(argv)
    parser = build_parser(everything=_ALL in typed)
    try:
        check_words(typed, parser.list_options())
        arguments = _parse(parser, typed)
        arguments.typed = shlex.join(["quadriga", *typed])
        arguments.every_command = lambda: build_parser(everything=True).commands
        interrupt_on_sigterm()
        if arguments.parent:
            die_with_parent(arguments.parent)
            kill_if_orphaned(arguments.parent)
        config, given = read_config(arguments)
        with registered(arguments, config):
            status: int = arguments.call(arguments, config, given)
    except ProcessError as error:
        return _complain(error, FAILED)
    except QuadrigaError as error:
        return _complain(error, WRONG)
    except KeyboardInterrupt:
        print("quadriga: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # of `quadriga config | head`
        sys.stdout = None
        return 0
    except OSError as error:  # a disk that is full, a folder that is read-only
        what, reason = error.filename or "a file or a connection", system_reason(error)
        return _complain(
            ConfigError(str(what), reason, "one that can be used", remedy(error)), WRONG
        )
    return status


def _parse(parser: CommandLine, typed: Sequence[str]) -> argparse.Namespace:
    """The options and words that were typed.

    Raises:
        ConfigError: the command has no place for one of the words.
    """
    arguments, strays = parser.parse_known_args(typed)
    command = parser.commands[arguments.command]
    _refuse_repeats(command, typed)
    if strays:
        from quadriga.team.scenarios import names

        places = [takes(action) for action in command._actions if not action.option_strings]
        refuse_strays(arguments.command, strays, places, list_options(command), names())
    return arguments


def _refuse_repeats(command: argparse.ArgumentParser, typed: Sequence[str]) -> None:
    """Refuse an option of several values that is given twice: only the last one would count."""
    several = [action for action in command._actions if _takes_several(action)]
    actions = {option: action for action in several for option in action.option_strings}
    seen = set[argparse.Action]()
    for word in takewhile("--".__ne__, typed):
        action = actions.get(word.partition("=")[0])
        if action in seen:
            raise ConfigError(word.partition("=")[0], "twice", "once, with all of them")
        if action is not None:
            seen.add(action)


def _takes_several(action: argparse.Action) -> bool:
    is_key = "." in action.dest
    return action.nargs == "+" or (is_key and "commas" in describe_key(action.dest)["help"])


@cache
def build_parser(*, everything: bool = False) -> CommandLine:
    """The parser of the whole command line.

    Args:
        everything: show in each command's help the options of the configuration, too.
    """
    top = CommandLine(
        prog="quadriga",
        usage="quadriga [-h] [--version] COMMAND …",
        description=_ABOUT,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action=_ShowVersion, help="print the version")
    commands = top.add_subparsers(
        metavar="COMMAND",
        required=True,
        prog="quadriga",
        help=argparse.SUPPRESS,
        parser_class=argparse.ArgumentParser,
    )
    told: dict[str, str] = {}

    def add_command(name: str, run: Run, doc: str) -> argparse.ArgumentParser:
        command = commands.add_parser(
            name,
            description=doc,
            parents=[build_config_options(name, hidden=not everything)],
            allow_abbrev=False,
        )
        command.set_defaults(call=run, command=name)
        told[name] = doc
        return command

    groups = []
    for title, adds in GROUPS.items():
        before = len(told)
        for add in adds:
            add(add_command)
        groups.append((title, list(told.items())[before:]))
    top.commands = commands.choices
    for command in top.commands.values():
        for action in command._actions:
            action.type = READ_AS.get(action.type, action.type)
    top.epilog = _format_groups(groups)
    return top


def list_options(parser: argparse.ArgumentParser) -> list[str]:
    """All options of a parser, also those that its help does not show."""
    return [option for action in parser._actions for option in action.option_strings]


def takes(action: argparse.Action) -> str:
    """What stands for an argument's value in a usage line."""
    choices = "|".join(map(str, action.choices or ()))
    name = str(action.metavar or choices or action.dest.upper())
    return {"*": f"[{name} …]", "+": f"{name} …", "?": f"[{name}]"}.get(str(action.nargs), name)


def _format_groups(groups: Sequence[tuple[str, Sequence[tuple[str, str]]]]) -> str:
    width = max(len(name) for _, commands in groups for name, _ in commands)
    parts = [
        "\n".join([f"{title}:", *(f"  {name:{width}}  {doc}" for name, doc in commands)])
        for title, commands in groups
    ]
    return "\n\n".join([*parts, _MORE])


def _complain(error: QuadrigaError, status: int) -> int:
    shown = (
        printable if isinstance(error, ProcessError) else printable_line
    )  # with a log's last lines
    print(shown(f"quadriga: {error}"), file=sys.stderr)
    return status
