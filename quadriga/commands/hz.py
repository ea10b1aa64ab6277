"""`quadriga hz`: rates, intervals and gaps by key."""

from __future__ import annotations

import argparse
from contextlib import closing

from quadriga.commands.command import AddCommand, Given, say
from quadriga.commands.options import KEY_HELP, add_source
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.signals import stop_flag


def add(add_command: AddCommand) -> None:
    command = add_command("hz", run, "print how often messages come, live or from a recording")
    command.add_argument("keys", nargs="*", metavar="KEY", help=f"{KEY_HELP} (all)")
    command.add_argument(
        "--every", type=float, default=1.0, metavar="S", help="live: seconds between two tables (1)"
    )
    add_source(command, "tables")


def run(arguments: argparse.Namespace, config: Config, _given: Given) -> int:
    """Print one table of a recording, or one every few seconds of what is on the bus."""
    return _print_recorded(arguments) if arguments.file else _print_live(arguments, config)


def _print_recorded(arguments: argparse.Namespace) -> int:
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
    from quadriga.recordings.listen import entries_from_bus
    from quadriga.recordings.rates import Rates

    if arguments.count < 0 or not arguments.every > 0.0:
        raise ConfigError("-n, --every", f"{arguments.count}, {arguments.every:g}", "more than 0")
    rates, printed, begun = Rates(config), 0, monotonic()
    with (
        stop_flag() as stopped,
        closing(entries_from_bus(config, "hz", arguments.keys, stopped, say)) as entries,
    ):
        for entry in entries:
            if entry is not None:
                rates.add(entry)
            if monotonic() - begun < arguments.every or rates.empty:
                continue
            print("\n".join((*rates.format_table(), "")), flush=True)
            rates.restart()
            begun = monotonic()
            printed += 1
            if printed == arguments.count:
                break
    return 0
