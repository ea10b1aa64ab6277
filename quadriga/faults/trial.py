"""SHELL of one walk with one fault: everything started, the fault made, all taken down."""

from __future__ import annotations

import os
import shutil
import signal
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.faults.aftermath import await_end, consult_doctor, read_log
from quadriga.faults.fault import Draw, FaultScene, Stage, TeamFault
from quadriga.faults.outcome import Moment, describe_outcome
from quadriga.faults.teller import LEAD_MS, FaultTeller
from quadriga.recordings.summary import RECORDING
from quadriga.recordings.traces import read_traces
from quadriga.shared.bus.session import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ProcessError, RecordingError
from quadriga.shared.members import LAUNCHER, SIM, has_lead
from quadriga.shared.messages import parse_events
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.clock import monotonic, sleep, wall_ns
from quadriga.shared.runtime.scheduling import go_first, leave_priority
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table, router_row
from quadriga.team.run_folder import CONFIG

_EARLIEST_S, _LATEST_S = 1.5, 4.0  # from the begin of a walk until something goes wrong
_AFTER_S: Final = 4.0  # world time that is walked at least after it
_START_S: Final = 120.0  # for the team to start
_DOCTOR_S: Final = 1.0  # wall time from a fault until the doctor is asked
_LOOK: Final = 0.005  # s


def run_fault_trial(
    config: Config, fault: TeamFault, seed: int, folder: Path, predictor: Path | None
) -> dict[str, Any]:
    """Walk once with a fault; a row of the table.

    Args:
        config: of a simulated world.
        fault: what goes wrong, at a moment and at a robot that the seed decides.
        seed: of the world.
        folder: of this walk alone; gets configuration, logs and recording.
        predictor: its file; None without one.

    Raises:
        ProcessError: the team did not begin to walk.
    """
    shutil.rmtree(folder, ignore_errors=True)  # a walk of an earlier call, which was interrupted
    folder.mkdir(parents=True)
    draw = draw_fault(config, seed)
    if fault.given is not None:
        robot, tick = fault.given
        draw = Draw(robot or draw.robot, tick, seed, chosen=bool(robot))
    with fault.stage(_walk_config(config, fault, draw), draw, folder) as stage:
        config = stage.config
        write_text(folder / CONFIG, to_toml(config))
        rows = process_table(config, folder, predictor, "")
        if config.bus.mode == "client":
            rows = (router_row(config, folder), *rows)
        with Launch(tuple(map(stage.wrap, rows)), folder / "logs") as launch:
            scene = FaultScene(config, draw, folder, launch)
            moment = _FaultTrial(scene, fault, stage).run()
    outcome = _describe(config, moment, folder)
    return {"fault": fault.name, "seed": seed} | outcome | scene.facts


def draw_fault(config: Config, seed: int) -> Draw:
    """Whom a fault meets, and when: chance of the seed alone."""
    chance = np.random.default_rng((seed, 1))
    names = robot_names(config.team.robots)
    robot = names[chance.integers(len(names))]
    tick = config.gait.stand_ms + round(1000 * chance.uniform(_EARLIEST_S, _LATEST_S))
    return Draw(robot, tick, seed)


def _walk_config(config: Config, fault: TeamFault, draw: Draw) -> Config:
    world = replace(
        config.world,
        seed=draw.seed,
        mode="realtime" if fault.realtime else "lockstep",
        duration=max(config.world.duration, 1e-3 * draw.tick + _AFTER_S),
    )
    bus = replace(config.bus, endpoint=free_endpoint())
    return replace(config, world=world, bus=bus, recorder=replace(config.recorder, enabled=True))


class _FaultTrial:
    def __init__(self, scene: FaultScene, fault: TeamFault, stage: Stage) -> None:
        self._scene, self._fault, self._stage = scene, fault, stage
        self._config, self._launch = scene.config, scene.launch

    def run(self) -> Moment:
        """Wait for the moment, let the fault happen, and wait until the walk is over."""
        draw, strike = self._scene.draw, self._stage.strike
        if strike is None:
            await_end(self._scene)
            return Moment(draw.robot, draw.tick)
        with Bus.open(self._config.bus, self._config.team.name, LAUNCHER, lambda: False) as bus:
            teller = FaultTeller(bus, self._fault.base or self._fault.name, self._stage)
            go_first(alone=True)  # or, on a busy computer, the clock it has read is an old one
            try:
                self._announce(teller)
                tick = self._await_tick(teller, draw.tick)
                at, begun = wall_ns(), monotonic()
                strike(self._scene)
                struck = monotonic()
            finally:
                leave_priority()
            # To leave the bus takes seconds where somebody is frozen: only once the walk is over.
            with teller.telling_end(struck):
                self._await_outcome(begun)
        return Moment(draw.robot, tick, at)

    def _announce(self, teller: FaultTeller) -> None:
        """Tell the recording of the fault a little before it comes."""
        tick = self._scene.draw.tick
        self._await_tick(teller, max(1, tick - LEAD_MS))
        teller.tell_begin(tick)

    def _await_outcome(self, begun: float) -> None:
        """Ask the doctor, wait until the walk is over, and end whoever cannot end by itself."""
        if SIM not in self._scene.struck:  # else there is nobody to be asked about
            sleep(begun + _DOCTOR_S - monotonic())
            consult_doctor(self._scene)
        await_end(self._scene, begun)
        for name in self._scene.struck & self._launch.pids.keys():
            with suppress(OSError):  # it has ended by itself
                os.kill(self._launch.pids[name], signal.SIGKILL)

    def _await_tick(self, teller: FaultTeller, wanted: int) -> int:
        """Wait until the world's clock has come to a tick; what it shows then."""
        deadline = monotonic() + _START_S + 1e-3 * wanted
        while monotonic() < deadline and has_lead(self._launch.alive):
            if teller.read_clock() >= wanted:
                return teller.tick
            sleep(_LOOK)
        raise ProcessError("the team", "no walk", f"one that comes to {1e-3 * wanted:g} s")


def _describe(config: Config, moment: Moment, folder: Path) -> dict[str, Any]:
    """What the recording says of it, as far as it can be read."""
    try:
        recording = Recording(folder / RECORDING)
        told = list(parse_events(read_log(folder, SIM)))
        return describe_outcome(config, read_traces(recording), recording, moment, told)
    except RecordingError as error:
        # Rows are published, and where they were walked is nobody's business.
        return {"robot": moment.robot, "error": str(error).replace(f"{folder}/", "")}
