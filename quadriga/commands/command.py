"""What each module of this folder gives: `add`, a command's options, and `run`, its call.

Every process of a team reads the whole command line, so `run` imports what it needs itself.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from typing import Any

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.printable import printable_line

Given = dict[str, Any]
"""The keys that were given explicitly, by section and key."""

Run = Callable[[argparse.Namespace, Config, Given], int]
"""From the options, the configuration in force and what of it was given to the exit status."""

AddCommand = Callable[[str, Run, str], argparse.ArgumentParser]
"""Adds a command by its name, its call and what it does, in a few words."""


def say(text: str) -> None:
    """Tell the user something beside a command's output."""
    print(f"quadriga: {printable_line(text)}", file=sys.stderr, flush=True)


def check_options_beside(
    switch: str, chosen: bool, needing: Mapping[str, object], excluding: Mapping[str, object]
) -> None:
    """See that no option is given that would be ignored.

    Args:
        switch: an option that changes what the command does.
        chosen: whether it is given.
        needing: by their name the values of options that mean something with it alone.
        excluding: of those that mean nothing with it; None or False if one is not given.

    Raises:
        ConfigError: there is such an option.
    """
    for name, value in (excluding if chosen else needing).items():
        if value is not None and value is not False:
            got = f"{switch} beside it" if chosen else f"no {switch} beside it"
            raise ConfigError(name, got, "one of the two" if chosen else "both, or none of the two")


def refuse_configuration(given: Given) -> None:
    """Refuse configuration that would be ignored, since the recording has its own.

    Raises:
        ConfigError: some was given.
    """
    if given:
        names = [f"{section}.{key}" for section, keys in given.items() for key in keys]
        raise ConfigError(
            "options",
            ", ".join(names),
            "none of the configuration",
            "the recording's own configuration is used",
        )
