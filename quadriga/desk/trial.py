"""SHELL of one walk on the desk: everything started, one thing made to go wrong, all taken down."""

from __future__ import annotations

import os
import signal
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console

from quadriga.desk.faults import AGENT, NO_FAULT, PLANT, ROUTER, WATCHDOG, Fault
from quadriga.desk.outcome import (
    FELL,
    describe_walk,
    read_truth,
    time_kept,
    time_to_rest,
    traces_of,
)
from quadriga.desk.robots import SimulatedRobots
from quadriga.identification.predictors import ensure_predictor
from quadriga.recordings.readable import open_readable
from quadriga.recordings.summary import RECORDING
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import BRIDGED, SIMULATED, Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.errors import ProcessError, RecordingError
from quadriga.shared.members import SIM, plant_name
from quadriga.shared.messages import Event, Status, Truth
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.topics import EVENT, STATUS, topic_of
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, ProcessSpec, process_table, router_row
from quadriga.team.run_folder import CONFIG

_STEADY_S: Final = 4.0  # from the begin of a walk to its steady part
_EARLIEST_S, _LATEST_S = 2.0, 4.0  # from the begin of a walk until something goes wrong
_START_S: Final = 120.0  # for the team to start and stand up
_AFTER_S: Final = 12.0  # for robots to come to rest once a walk must be over
_WALKS: Final = "walk"
WITHOUT: Final = "without-bridges"  # in place of a fault: the same walk of the simulated world


def run_trial(config: Config, fault: Fault, seed: int, folder: Path) -> dict[str, Any]:
    """Walk once; a row of the table.

    Args:
        config: of bridged robots on this machine.
        fault: what goes wrong, at a moment that the seed decides.
        seed: of the world.
        folder: gets configuration, logs, recording and truth.

    Raises:
        ProcessError: the simulated robots did not come up, or the team did not begin to walk.
    """
    folder.mkdir(parents=True, exist_ok=True)
    routed = ROUTER in fault.processes
    config = replace(
        config,
        world=replace(config.world, seed=seed),
        bus=replace(
            config.bus, endpoint=free_endpoint(), mode="client" if routed else config.bus.mode
        ),
    )
    write_text(folder / CONFIG, to_toml(config))
    with SimulatedRobots(folder / CONFIG, config.team.robot, folder) as robots:
        with Launch(_rows(config, folder, routed), folder / "logs") as launch:
            trial = _Trial(config, fault, folder, robots, launch)
            row = trial.run(np.random.default_rng(seed))
        row |= trial.come_to_rest()
    return {"fault": fault.name, "seed": seed} | row | trial.describe()


def _rows(config: Config, folder: Path, routed: bool) -> Sequence[ProcessSpec]:
    predictor = None
    if find_kind(config.planner.kind).needs_predictor:
        predictor = ensure_predictor(config, Console(stderr=True))
    rows = process_table(config, folder, predictor, "", armed=config.team.plant == BRIDGED)
    return (router_row(config, folder), *rows) if routed else rows


class _Trial:
    def __init__(
        self, config: Config, fault: Fault, folder: Path, robots: SimulatedRobots, launch: Launch
    ) -> None:
        self._config, self._fault, self._folder = config, fault, folder
        self._robots, self._launch = robots, launch
        self._names = robot_names(config.team.robots)
        self._begun = self._since = 0
        self._patient = ""

    def run(self, random: np.random.Generator) -> dict[str, Any]:
        """Wait for the walk, let the fault happen, and wait until the robots are at rest."""
        if not self._robots.wait_until(self._all_walk, _START_S):
            raise ProcessError("the team", self._last_words(), f"a walk within {_START_S:g} s")
        self._begun = self._robots.order("all clear")
        after = 0.0
        if self._fault is not NO_FAULT:
            after = random.uniform(_EARLIEST_S, _LATEST_S)
            self._patient = self._fault.robot or self._names[random.integers(len(self._names))]
        self._robots.wait_until(lambda: False, after)
        self._since = self._robots.order("all clear")
        if early := [name for name in self._names if self._modes(name)[-1] != _WALKS]:
            raise ProcessError("the team", f"{self._modes(early[0])[-1]} of {early[0]}", "a walk")
        pids = [pid for what in self._fault.processes for pid in self._pids(what)]
        # Frozen first: none may see that another is gone before it goes itself.
        for sent in (signal.SIGSTOP, self._fault.signal):
            for pid in pids:
                os.kill(pid, sent)
        for order in self._fault.orders:
            self._since = self._robots.order(f"{self._patient} {order}")
        longest = self._config.world.duration + self._config.bridge.stand_s + _AFTER_S
        self._robots.wait_until(self._is_over, longest)
        for pid in pids:
            with suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        return {"robot": self._patient, "after_s": round((self._since - self._begun) / 1000, 2)}

    def come_to_rest(self) -> dict[str, Any]:
        """Wait until no motor is driven any more, the team being gone."""
        self._robots.wait_until(self._all_off, _AFTER_S)
        said = self._robots.said()
        rest = {name: time_to_rest(said, name, self._since) for name in self._names}
        first = min((ms for ms in rest.values() if ms is not None), default=None)
        end = said[-1].ms if first is None else self._since + first
        return {"rest_ms": rest, "kept": time_kept(said, self._begun, end)}

    def describe(self) -> dict[str, Any]:
        """What the robots did, and what was said of it."""
        traces = read_truth(self._robots.truth, self._names)
        tilts = {name: traces[name].tilt(self._since) for name in self._names}
        figures: dict[str, Any] = {}
        if self._fault is NO_FAULT:
            end = self._begun + 1000.0 * self._config.world.duration
            steady = self._begun + 1000.0 * _STEADY_S
            figures = {n: describe_walk(traces[n], steady, end) for n in self._names}
        return {
            "tilt_max": {name: round(tilt, 3) for name, tilt in tilts.items()},
            "fell": [name for name, tilt in tilts.items() if tilt > FELL],
            "said": {name: self._modes(name) for name in self._names},
            "figures": figures,
            **self._recorded(),
        }

    def _recorded(self) -> dict[str, Any]:
        """Last status of each bridge, why agents stopped, how the walk ended, what was late."""
        try:
            source, _ = open_readable(self._folder / RECORDING)
        except RecordingError as error:
            return {"end": str(error), "status": {}, "agents": {}, "late": {}}
        last, end = dict[str, Status](), "none recorded"
        for entry in source.entries():
            topic, member = topic_of(entry.key)
            if topic is STATUS:
                last[member] = decode(entry.payload, Status)
            if topic is not EVENT:
                continue
            event = decode(entry.payload, Event)
            end = f"{event.code}: {event.detail}" if event.kind == "stop" else end
        plants = {n: last[plant_name(n)] for n in self._names if plant_name(n) in last}
        return {
            "end": end,
            "status": {
                name: f"{plant.mode} {plant.reason}".strip() for name, plant in plants.items()
            },
            "agents": {name: last[name].reason for name in self._names if name in last},
            "late": {n: late_of(p, n) for n, p in plants.items()},
        }

    def _all_walk(self) -> bool:
        return all(any(_WALKS in line for line in self._modes(name)) for name in self._names)

    def _is_over(self) -> bool:
        """Whether all processes have left but those that cannot."""
        left = self._launch.alive
        gone = {self._name_of(what) for what in self._fault.processes}
        return not (left - gone) or self._all_off()

    def _all_off(self) -> bool:
        last = dict[str, str]()
        for said in self._robots.said():
            robot, _, what = said.text.partition(" ")
            if robot in self._names and what.startswith("motors"):
                last[robot] = what
        return all(last.get(name) == "motors off" for name in self._names)

    def _modes(self, robot: str) -> list[str]:
        """What the robot's bridge has said of it."""
        log = self._folder / "logs" / f"{plant_name(robot)}.log"
        if not log.is_file():
            return []
        begin = f"bridge: {robot}: "
        lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
        return [line.removeprefix(begin) for line in lines if line.startswith(begin)]

    def _name_of(self, what: str) -> str:
        return {PLANT: plant_name(self._patient), AGENT: self._patient}.get(what, what)

    def _pids(self, what: str) -> list[int]:
        pids = self._launch.pids
        if what == WATCHDOG:
            return children_of(pids[plant_name(self._patient)])
        return [pids[self._name_of(what)]]

    def _last_words(self) -> str:
        words = []
        for log in sorted((self._folder / "logs").glob("*.log")):
            lines = log.read_text(encoding="utf-8", errors="replace").splitlines()[-3:]
            words += [f"  {log.stem}: {line}" for line in lines]
        return "\n".join(words)


def children_of(pid: int) -> list[int]:
    """Processes that a process has started, and that are not over."""
    children = list[int]()
    for tasks in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            children += map(int, tasks.read_text().split())
    return children


def late_of(plant: Status, robot: str) -> dict[str, float]:
    """Age of the commands that a robot's motors followed, ms, and the share of late ones.

    Keys are `command.median`, `command.p99`, `command.max`, of a bridge also `answer.…`, from the
    arrival of a report to the command made of it, and `share`.
    """
    begin, due = f"{robot}.", plant.counters.get(f"{robot}.due", 0)
    ages = {k.removeprefix(begin): v for k, v in plant.ages_ms.items() if k.startswith(begin)}
    return {**ages, "share": plant.counters.get(f"{robot}.late", 0) / max(due, 1)}


def walk_without_bridges(config: Config, seed: int, folder: Path) -> dict[str, Any]:
    """The same walk of the simulated world without bridges, in real time; a row of the table.

    Args:
        config: of bridged robots on this machine.
        seed: of the world.
        folder: gets configuration, logs and recording.

    Raises:
        ProcessError: a process failed or left too early.
    """
    folder.mkdir(parents=True, exist_ok=True)
    config = replace(
        config,
        team=replace(config.team, plant=SIMULATED, plant_per_robot=False),
        world=replace(config.world, seed=seed),
        bus=replace(config.bus, endpoint=free_endpoint()),
    )
    write_text(folder / CONFIG, to_toml(config))
    with Launch(_rows(config, folder, routed=False), folder / "logs") as launch:
        launch.watch(lambda: False)
    recording = Recording(folder / RECORDING)
    names, traces = robot_names(config.team.robots), traces_of(list(recording.messages(Truth)))
    end = 1000.0 * config.world.duration
    plant = list(recording.messages(Status, SIM))[-1]
    tilts = {name: trace.tilt(0.0) for name, trace in zip(names, traces, strict=True)}
    return {
        "fault": WITHOUT,
        "seed": seed,
        "tilt_max": tilts,
        "fell": [name for name, tilt in tilts.items() if tilt > FELL],
        "figures": {
            name: describe_walk(trace, 1000.0 * _STEADY_S, end)
            for name, trace in zip(names, traces, strict=True)
        },
        "agents": {name: list(recording.messages(Status, name))[-1].reason for name in names},
        "late": {name: late_of(plant, name) for name in names},
    }
