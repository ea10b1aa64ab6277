"""Faults of processes that have too little: of the processor, of the disk, of the network."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from quadriga.faults import bystander
from quadriga.faults.fault import OWN, Draw, FaultScene, SetStage, Stage, TeamFault, strike_with
from quadriga.recordings.summary import RECORDING
from quadriga.shared.config.sections import Config
from quadriga.shared.members import RECORDER
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.runtime.installed import PYTHON
from quadriga.team.run_folder import CONFIG

_SLOW_S: Final = 2.0  # for which a process gets too little of the processor
_TURN_S: Final = 0.04  # of which it runs for the second half
_FULL_S: Final = 7.0  # world time that is walked after a bystander has been started
_PATIENCE_S: Final = 10.0  # for a bystander to be on the bus
_LOOK_S: Final = 0.01


class _SlowDown:
    """Let a process run half of the time only, for a while."""

    def __init__(self, process: str) -> None:
        self._process = process

    def __call__(self, scene: FaultScene) -> None:
        pid, begun = scene.launch.pids[scene.name_of(self._process)], monotonic()
        for number in range(round(_SLOW_S / _TURN_S)):
            os.kill(pid, signal.SIGSTOP)
            sleep(begun + (number + 0.5) * _TURN_S - monotonic())
            os.kill(pid, signal.SIGCONT)
            sleep(begun + (number + 1.0) * _TURN_S - monotonic())


class _Bystander:
    """Start a process beside the team; `end` takes it down."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._process: subprocess.Popen[bytes] | None = None

    def __call__(self, scene: FaultScene) -> None:
        log, config = scene.folder / "logs" / f"{self._kind}.log", scene.folder / CONFIG
        with log.open("wb") as file:
            command = [*PYTHON, "-m", bystander.__name__, self._kind, str(config)]
            self._process = subprocess.Popen(
                [*command, str(os.getpid())], stdin=subprocess.DEVNULL, stdout=file, stderr=file
            )
        deadline = monotonic() + _PATIENCE_S
        while bystander.THERE.encode() not in log.read_bytes() and monotonic() < deadline:
            sleep(_LOOK_S)

    def end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()


def _with_bystander(kind: str, lasts: float | None = None) -> SetStage:
    """A team and a bystander at one router, long enough for that to be full."""

    @contextmanager
    def stage(config: Config, draw: Draw, _folder: Path) -> Iterator[Stage]:
        beside = _Bystander(kind)
        seconds = max(config.world.duration, 1e-3 * draw.tick + _FULL_S)
        world, bus = replace(config.world, duration=seconds), replace(config.bus, mode="client")
        try:
            yield Stage(replace(config, world=world, bus=bus), beside, lasts=lasts)
        finally:
            beside.end()

    return stage


def _fill_disk(scene: FaultScene) -> None:
    """Let the recorder's file grow no more: the system refuses what it writes, as a full disk."""
    size = (scene.folder / RECORDING).stat().st_size
    resource.prlimit(scene.launch.pids[RECORDER], resource.RLIMIT_FSIZE, (size, size))


_HALF: Final = f"runs half of the time only for {_SLOW_S:g} s"

LOAD_FAULTS: Final = (
    TeamFault("agent-slow", f"an agent's process {_HALF}", strike_with(_SlowDown(OWN), OWN, 0.0)),
    TeamFault(
        "recorder-slow", f"the recorder {_HALF}", strike_with(_SlowDown(RECORDER), lasts=0.0)
    ),
    TeamFault(
        "subscriber-slow",
        "behind a router a process joins, hears all and stands still for good",
        _with_bystander(bystander.DEAF),
    ),
    TeamFault(
        "flood",
        f"a process sends what it can for {bystander.FLOOD_S:g} s, behind a router",
        _with_bystander(bystander.FLOOD, bystander.FLOOD_S),
    ),
    TeamFault("disk-full", "the recorder's disk is full", strike_with(_fill_disk)),
)
"""In the order of the table."""
