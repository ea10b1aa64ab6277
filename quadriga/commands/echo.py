"""`quadriga echo`: messages as text, one line each."""

from __future__ import annotations

import argparse
from contextlib import closing

from quadriga.commands.command import AddCommand, Given, say
from quadriga.commands.options import KEY_HELP, add_source
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.signals import stop_flag


def add(add_command: AddCommand) -> None:
    command = add_command("echo", run, "print messages, live or from a recording, one line each")
    command.add_argument("key", nargs="+", metavar="KEY", help=KEY_HELP)
    command.add_argument("--full", action="store_true", help="every number of every array")
    add_source(command, "messages")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print messages until the recording's end, the count asked for, or a signal."""
    from quadriga.recordings.echo import format_entry
    from quadriga.recordings.listen import entries_from_bus, entries_from_file

    file, keys = arguments.file, arguments.key
    if arguments.count < 0:
        raise ConfigError("-n", str(arguments.count), "at least 0")
    printed = 0
    with stop_flag() as stopped:
        source = (
            entries_from_file(file, keys)
            if file
            else entries_from_bus(config, "echo", keys, stopped, say)
        )
        with closing(source) as entries:
            for entry in entries:
                if stopped():
                    break
                if entry is None:
                    continue
                print(format_entry(entry, full=arguments.full), flush=not file)
                printed += 1
                if printed == arguments.count:
                    break
    return 0
