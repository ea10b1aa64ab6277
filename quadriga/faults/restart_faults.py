"""Faults of processes that are started again, and of the world and the router that are gone."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.faults.fault import (
    OWN,
    Draw,
    FaultScene,
    SetStage,
    Stage,
    TeamFault,
    robot_of,
    strike_with,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR, RECORDER, ROUTER, SIM
from quadriga.shared.runtime.clock import monotonic, sleep

_DOWN_S: Final = 1.0  # from the end of a process to its next start
_BACK_S: Final = 7.0  # world time for it to start, and for the team to walk again
_RISE_S: Final = 5.0  # more, for an agent to start beside others that walk, and to get its robot up


class _Restart:
    """Kill a process and start it again, as whoever keeps services running does."""

    def __init__(self, process: str, down_s: float) -> None:
        self._process, self._down_s = process, down_s

    def __call__(self, scene: FaultScene) -> None:
        name, begun = scene.name_of(self._process), monotonic()
        os.kill(scene.launch.pids[name], signal.SIGKILL)
        sleep(begun + self._down_s - monotonic())
        scene.launch.restart(name)


class _Loss:
    """Take the world from a team: its robots have no power any more, and all others leave."""

    def __init__(self, number: signal.Signals) -> None:
        self._number = number

    def __call__(self, scene: FaultScene) -> None:
        scene.struck.add(SIM)
        os.kill(scene.launch.pids[SIM], self._number)


def _restarted(process: str, down_s: float = _DOWN_S) -> SetStage:
    """A team that goes on by itself once all is there again, and has the time to do so."""

    @contextmanager
    def stage(config: Config, draw: Draw, _folder: Path) -> Iterator[Stage]:
        back_s = down_s + _BACK_S + (_RISE_S if process == OWN else 0.0)
        seconds = max(config.world.duration, 1e-3 * draw.tick + back_s)
        bus = replace(config.bus, mode="client") if process == ROUTER else config.bus
        yield Stage(
            replace(
                config,
                bus=bus,
                team=replace(config.team, auto_resume=True),
                world=replace(config.world, duration=seconds),
            ),
            _Restart(process, down_s),
            robot=robot_of(process, draw),
            lasts=0.0,
        )

    return stage


_AGAIN: Final = f"killed, and started again after {_DOWN_S:g} s"

RESTART_FAULTS: Final = (
    TeamFault("agent-restarted", f"an agent's process is {_AGAIN}", _restarted(OWN)),
    TeamFault("operator-restarted", f"the operator is {_AGAIN}", _restarted(OPERATOR)),
    TeamFault("recorder-restarted", f"the recorder is {_AGAIN}", _restarted(RECORDER)),
    TeamFault("router-restarted", f"the router is {_AGAIN}", _restarted(ROUTER)),
    TeamFault("router-replaced", "another router takes its place at once", _restarted(ROUTER, 0.0)),
    TeamFault("sim-killed", "the world is killed", strike_with(_Loss(signal.SIGKILL))),
    TeamFault("sim-frozen", "the world stands still for good", strike_with(_Loss(signal.SIGSTOP))),
)
"""In the order of the table."""
