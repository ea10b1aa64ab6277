"""`quadriga completion`: what a shell completes on the command line."""

from __future__ import annotations

import argparse
from typing import Final

from quadriga.commands.command import AddCommand, Given
from quadriga.shared.config.sections import Config

_SHELLS: Final = ("bash", "zsh", "fish")


def add(add_command: AddCommand) -> None:
    command = add_command("completion", run, "print what makes a shell complete this command line")
    command.add_argument("shell", choices=_SHELLS, help="whose script it is")
    command.epilog = (
        "bash: source <(quadriga completion bash) in ~/.bashrc. zsh: the same in ~/.zshrc "
        "behind compinit. fish: quadriga completion fish > ~/.config/fish/completions/quadriga.fish"
    )


def run(arguments: argparse.Namespace, _config: Config, _given: Given) -> int:
    """Print the script, from the parsers of all commands, which `main` hands over."""
    from quadriga.commands.completed_words import list_commands
    from quadriga.commands.completion_scripts import WRITERS
    from quadriga.experiments.published.catalogue import list_names
    from quadriga.faults.catalogue import ALL, BY_NAME
    from quadriga.team import scenarios

    names = {
        "--scenario": scenarios.names(),
        "campaign": scenarios.names(),
        "experiments": list_names(),
        "fault": (ALL, *(name for name in BY_NAME if " " not in name)),
    }
    commands = list_commands(arguments.every_command(), names)
    print(WRITERS[arguments.shell](commands), end="")
    return 0
