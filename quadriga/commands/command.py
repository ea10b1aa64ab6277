"""What each module of this folder gives: `add`, a command's options, and `run`, its call.

Every process of a team reads the whole command line, so `run` imports what it needs itself.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
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
