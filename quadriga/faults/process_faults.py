"""Faults of processes: they are killed, or stand still."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final, TypeAlias

from quadriga.faults.fault import OWN, Draw, FaultScene, SetStage, Stage, TeamFault, strike_with
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR, RECORDER, ROUTER, SIM
from quadriga.shared.runtime.clock import monotonic, sleep

_FULL_S: Final = 6.0  # world time that is walked after it
_PAUSE_S: Final = 0.3  # of a process that stands still for a while

_Signals: TypeAlias = tuple[tuple[signal.Signals, float], ...]
"""Each with the time since the first, s."""

_KILL: Final[_Signals] = ((signal.SIGKILL, 0.0),)
_STOP: Final[_Signals] = ((signal.SIGSTOP, 0.0),)
_PAUSE: Final[_Signals] = ((signal.SIGSTOP, 0.0), (signal.SIGCONT, _PAUSE_S))


class _Strike:
    """Send a process its signals."""

    def __init__(self, process: str, signals: _Signals) -> None:
        self._process, self._signals = process, signals

    def __call__(self, scene: FaultScene) -> None:
        name = scene.name_of(self._process)
        if self._signals[-1][0] != signal.SIGCONT:
            scene.struck.add(name)
        pid, begun = scene.launch.pids[name], monotonic()
        for number, after in self._signals:
            sleep(begun + after - monotonic())
            os.kill(pid, number)


def _stage(process: str, signals: _Signals) -> SetStage:
    strike = _Strike(process, signals)
    lasts = 0.0 if signals[-1][0] == signal.SIGCONT else None
    if process != ROUTER and (process, signals) != (RECORDER, _STOP):
        return strike_with(strike, process, lasts)

    @contextmanager
    def stage(config: Config, draw: Draw, _folder: Path) -> Iterator[Stage]:
        # Who stands still behind a router might hold it up, but only once all that lies between
        # them is full.
        bus = replace(config.bus, mode="client")
        seconds = max(config.world.duration, 1e-3 * draw.tick + _FULL_S)
        world = replace(config.world, duration=seconds)
        yield Stage(replace(config, bus=bus, world=world), strike, lasts=lasts)

    return stage


def _paused(name: str, what: str, process: str) -> TeamFault:
    def lasting(seconds: float) -> SetStage:
        return _stage(process, ((signal.SIGSTOP, 0.0), (signal.SIGCONT, seconds)))

    return TeamFault(name, what, _stage(process, _PAUSE), lasting=lasting)


_PAUSED: Final = f"it stands still for {_PAUSE_S:g} s"
_ROUTER_KILLED: Final = "the router is killed: nobody hears anybody"

PROCESS_FAULTS: Final = (
    TeamFault("agent-killed", "an agent's process is killed", _stage(OWN, _KILL)),
    TeamFault("agent-frozen", "an agent's process stands still", _stage(OWN, _STOP)),
    _paused("agent-paused", _PAUSED, OWN),
    TeamFault("operator-killed", "the operator's process is killed", _stage(OPERATOR, _KILL)),
    TeamFault("operator-frozen", "it stands still", _stage(OPERATOR, _STOP)),
    _paused("operator-paused", _PAUSED, OPERATOR),
    TeamFault("recorder-killed", "the recorder is killed", _stage(RECORDER, _KILL)),
    TeamFault("recorder-frozen", "behind a router it stands still", _stage(RECORDER, _STOP)),
    _paused("recorder-paused", _PAUSED, RECORDER),
    _paused("sim-paused", "the world stands still", SIM),
    TeamFault("router-killed", _ROUTER_KILLED, _stage(ROUTER, _KILL)),
    TeamFault("router-frozen", "it stands still", _stage(ROUTER, _STOP)),
    _paused("router-paused", _PAUSED, ROUTER),
)
"""In the order of the table."""
