"""`quadriga echo`: messages as text, one line each, or how often they come."""

from __future__ import annotations

import argparse
from contextlib import closing
from typing import Final

from quadriga.commands.command import AddCommand, Given, check_options_beside, say
from quadriga.commands.options import KEY_HELP, add_source
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.signals import stop_flag

_EVERY_S: Final = 1.0


def add(add_command: AddCommand) -> None:
    command = add_command(
        "echo", run, "print messages or their rates, live or from a recording, one line each"
    )
    option = command.add_argument
    option("keys", nargs="*", metavar="KEY", help=f"{KEY_HELP}; with --rates none means all")
    option("--full", action="store_true", help="every number of every array")
    option(
        "--rates",
        action="store_true",
        help="instead a table by key: rates, intervals and gaps; live one every few seconds",
    )
    option(
        "--every",
        type=float,
        metavar="S",
        help=f"with --rates, live: seconds between two tables ({_EVERY_S:g})",
    )
    add_source(command, "messages or tables")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print messages or tables until the recording's end, the count asked for, or a signal."""
    check_options_beside(
        "--rates",
        arguments.rates,
        needing={"--every": arguments.every},
        excluding={"--full": arguments.full},
    )
    if arguments.count < 0:
        raise ConfigError("-n", str(arguments.count), "at least 0")
    if not arguments.rates:
        return _print_messages(arguments, config)
    return _print_recorded(arguments) if arguments.file else _print_live(arguments, config)


def _print_messages(arguments: argparse.Namespace, config: Config) -> int:
    from quadriga.recordings.echo import format_entry
    from quadriga.recordings.listen import entries_from_bus, entries_from_file

    file, keys = arguments.file, arguments.keys
    if not keys:
        raise ConfigError("KEY", "none", KEY_HELP, "'**' means every key")
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


def _print_recorded(arguments: argparse.Namespace) -> int:
    """Print one table of a recording."""
    from quadriga.recordings.listen import entries_from_file
    from quadriga.recordings.rates import Rates
    from quadriga.recordings.readable import config_or_default, open_readable

    source, _ = open_readable(arguments.file)
    rates = Rates(config_or_default(source))
    try:
        for entry in entries_from_file(arguments.file, arguments.keys):
            rates.add(entry)
    finally:  # of a damaged file, what was readable
        print("\n".join(rates.format_table()))
    return 0


def _print_live(arguments: argparse.Namespace, config: Config) -> int:
    """Print a table every few seconds of what is on the bus."""
    from quadriga.recordings.listen import entries_from_bus
    from quadriga.recordings.rates import Rates

    every = _EVERY_S if arguments.every is None else arguments.every
    if not every > 0.0:
        raise ConfigError("--every", f"{every:g}", "more than 0")
    rates, printed, begun = Rates(config), 0, monotonic()
    with (
        stop_flag() as stopped,
        closing(entries_from_bus(config, "echo", arguments.keys, stopped, say)) as entries,
    ):
        for entry in entries:
            if entry is not None:
                rates.add(entry)
            if monotonic() - begun < every or rates.empty:
                continue
            print("\n".join((*rates.format_table(), "")), flush=True)
            rates.restart()
            begun = monotonic()
            printed += 1
            if printed == arguments.count:
                break
    return 0
