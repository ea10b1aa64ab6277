"""How a command of the manual is run in some tenths of a second, or in one walk for all of them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from quadriga.commands.parser import main
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config
from quadriga.team.operator import references_of
from tests.manual.programs import read_command

WALKED: Final = 40  # ticks of a walk's short form
_LIMIT: Final = 120.0  # s, far more than a short walk takes on a busy machine
_LIVE_ONCE: Final = frozenset(("top", "hz", "echo"))  # go on until the walk is over, without -n
# Whose status tells how a team is, or what it did within seconds: a busy machine takes longer.
_JUDGES: Final = frozenset(("status", "stop", "resume"))
# Commands that are run as they are typed; the status of some tells what they found.
_LOOKING: Final = "check doctor echo export hz info replay report resim whatif"
_LISTING: Final = "completion config experiments fault scenarios version"
_AS_TYPED: Final = frozenset((*_LOOKING.split(), *_LISTING.split(), "campaign", "certs"))
_FINDS: Final = frozenset(("doctor", "replay"))


def run_short(words: Sequence[str]) -> None:
    """Run a command of `quadriga` in its short form, in the present folder.

    Of a walk whose folder the page goes on with all is walked; of another some ticks.

    Raises:
        AssertionError: it has none, or it failed.
    """
    read = read_command(words)
    if read is None:
        return
    command, config, _ = read
    if command != "walk":
        assert command in _AS_TYPED, f"{command} has no short form: say why it is not run"
        _run(words, (0, 1) if command in _FINDS else (0,))
    elif "--out" in words:
        _walk(words)
    else:
        walk_some_ticks(config)


def run_with(words: Sequence[str], options: Sequence[str]) -> None:
    """Run a command with options that make it short."""
    _run([*words, *options], (0,))


def run_live(words: Sequence[str]) -> None:
    """Run a command to a team that walks; one that would go on until its end, once."""
    once = ("-n", "1") if words[0] in _LIVE_ONCE and "-n" not in words else ()
    _run([*words, *once], (0, 1) if words[0] in _JUDGES else (0,))


def walk_some_ticks(config: Config) -> None:
    """Build the world of a walk and step its agents in it, without a planner."""
    planner = replace(config.planner, kind="none")
    config = replace(config, planner=planner)
    rollout = Rollout(config, None, references_of(config))
    for tick in rollout.ticks(WALKED):
        assert tick.outputs.keys() == rollout.agents.keys()
    assert rollout.world.tick == WALKED


def _run(words: Sequence[str], statuses: Sequence[int]) -> None:
    status = main(list(words))
    assert status in statuses, f"quadriga {' '.join(words)}: status {status}"


def _walk(words: Sequence[str]) -> None:
    command = (sys.executable, "-m", "quadriga", *words, "--no-view")
    done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT, check=False)
    assert done.returncode == 0, f"{done.stdout}{done.stderr}"
