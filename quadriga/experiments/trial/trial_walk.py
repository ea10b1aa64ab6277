"""A trial's walk: in this process, over the bus as processes of their own, or from a recording."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.agents.agent import Agent
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.team_planner import TeamPlanner, TeamResult
from quadriga.agents.predictor.predictor import Predictor
from quadriga.experiments.trial.trial import Walk
from quadriga.identification.rollout import Rollout, Tick
from quadriga.recordings.summary import RECORDING
from quadriga.recordings.traces import MeasurementTrace, Traces, read_traces
from quadriga.recordings.truth import build_truth_trace, ticks_of
from quadriga.shared.bus.members import PLANNER
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.recording.reader import Recording
from quadriga.shared.robot.a1 import robot_names
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.shared.wire.messages import Event, Measurement, Reference, Status, Truth
from quadriga.shared.wire.topics import (
    EVENT,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    REFERENCE_EPOCH_MS,
    SAMPLE_MS,
    STATUS,
    TRUTH,
)
from quadriga.sim_server.world.layout import NV
from quadriga.sim_server.world.world import World
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.operator import reference_at
from quadriga.team.run_folder import make_run_dir

_NEEDED: Final = {topic.name for topic in (TRUTH, REFERENCE, MEASUREMENT, PLAN, STATUS, EVENT)}


def roll_out(
    config: Config,
    predictor: Predictor | None,
    planner: TeamPlanner | None,
    watch: Callable[[Tick], None] | None = None,
) -> Walk:
    """Walk in this process, until `world.seconds` are over or a robot has fallen.

    Args:
        config: the team's configuration.
        predictor: None without a planner.
        planner: of the whole team, for the kinds of planner that are one process.
        watch: shown every tick.
    """
    timed = None if planner is None else _Timed(planner)
    rollout = Rollout(config, None, lambda tick: _reference(config, tick), planner=timed)
    if config.planner.kind not in (*CENTRAL, "none"):
        rollout.agents = {n: Agent(config, n, predictor, monotonic_ns) for n in rollout.agents}
    seen, meter = _Seen(config), _Meter(rollout.world)
    last = round(1000 * config.world.seconds)
    while rollout.world.tick < last and not rollout.world.fallen():
        if rollout.world.tick % SAMPLE_MS == 0:
            seen.truth.append(rollout.world.truth())
        tick = rollout.step()
        seen.note(tick)
        meter.note()
        if watch is not None:
            watch(tick)
    if timed is not None:
        seen.planner_ms[PLANNER] = timed.ms
        seen.plans += timed.plans
    return replace(seen.walk(), work=meter.work)


def over_the_bus(config: Config, run_dir: Path, predictor: Path | None, sha256: str) -> Walk:
    """Walk as processes of their own, as `quadriga walk` does, and read what they recorded.

    Args:
        config: the team's configuration.
        run_dir: a new folder for the recording and the processes' logs.
        predictor: its file; None without a planner.
        sha256: the predictor's digest, for the recording.

    Raises:
        ProcessError: a process failed or left too early.
        RecordingError: nothing was recorded.
        ConfigError: the folder holds a recording.
    """
    bus = replace(config.bus, endpoint=free_endpoint())
    config = replace(config, bus=bus, recorder=replace(config.recorder, enabled=True))
    make_run_dir(run_dir)
    (run_dir / "config.toml").write_text(to_toml(config), encoding="utf-8")
    with Launch(process_table(config, run_dir, predictor, sha256), run_dir / "logs") as launch:
        launch.watch(lambda: False)
    return recorded(run_dir / RECORDING)


def recorded(path: Path) -> Walk:
    """The walk in a recording.

    Raises:
        RecordingError: there is none, or it is empty or foreign.
    """
    recording = Recording(path)
    traces = read_traces(recording, _NEEDED)
    samples = {r: tuple(recording.messages(Measurement, r)) for r in traces.robots}
    plans = Counter(plan.status for found in traces.plans.values() for plan in found)
    return Walk(traces, samples, plans)


def _reference(config: Config, tick: int) -> Reference | None:
    """The reference as the operator sends it."""
    return reference_at(config, tick) if tick % REFERENCE_EPOCH_MS == 0 else None


class _Timed(TeamPlanner):
    """A team's planner that notes how long each step took and what came of it."""

    def __init__(self, planner: TeamPlanner) -> None:
        self._timed = planner
        self.ms: list[float] = []
        self.plans: Counter[str] = Counter()

    def step(self, inputs: Sequence[PlannerInputs]) -> TeamResult:
        begun = monotonic_ns()
        result = self._timed.step(inputs)
        self.ms.append(1e-6 * (monotonic_ns() - begun))
        self.plans[result.status] += len(inputs)
        return result


class _Meter:
    """Sums up what the motors do.

    A tick moves the joints by their rates at its end under the torques that acted in it, so that
    the sum is the work itself, not an approximation of it.
    """

    def __init__(self, world: World) -> None:
        n, physics = len(world.names), world.physics
        # Views of MuJoCo's own memory.
        self._torque = physics.qfrc_applied[: n * NV].reshape(n, NV)[:, 6:]
        self._rate = physics.qvel[: n * NV].reshape(n, NV)[:, 6:]
        self.work = 0.0

    def note(self) -> None:
        """Add the tick that has just been walked."""
        self.work += 1e-3 * float(np.abs(self._torque * self._rate).sum())


class _Seen:
    """What is seen of a walk in this process."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self.truth: list[Truth] = []
        self.events: list[Event] = []
        self.samples: defaultdict[str, list[Measurement]] = defaultdict(list)
        self.planner_ms: defaultdict[str, list[float]] = defaultdict(list)
        self.plans: Counter[str] = Counter()
        self._last: Tick | None = None

    def note(self, tick: Tick) -> None:
        """Add one tick."""
        self._last = tick
        self.events += tick.events
        for name, out in tick.outputs.items():
            if out.measurement is not None:
                self.samples[name].append(out.measurement)
            if out.plan is not None:
                self.plans[out.plan.status] += 1
            if out.planner_ns is not None:
                self.planner_ms[name].append(1e-6 * out.planner_ns)

    def walk(self) -> Walk:
        """All of it, in the form that a recording is read in."""
        config = self._config
        names = robot_names(config.team.robots)
        asked = [
            reference_at(config, tick)
            for tick in range(0, self.truth[-1].tick + 1, REFERENCE_EPOCH_MS)
        ]
        samples = {name: tuple(self.samples[name]) for name in names}
        traces = Traces(
            config=config,
            metadata={},
            robots=names,
            cut="",
            messages={},
            invalid={},
            ticks={},
            log_times=None,
            truth=build_truth_trace(self.truth, config),
            references=(ticks_of(asked), np.array([[r.vx, r.vy, r.wz, r.height] for r in asked])),
            measurements={
                name: MeasurementTrace(ticks_of(found), np.array([s.y for s in found]))
                for name, found in samples.items()
            },
            plans={name: () for name in names},
            statuses=self._statuses(),
            events=tuple(self.events),
        )
        return Walk(traces, samples, self.plans)

    def _statuses(self) -> dict[str, tuple[Status, ...]]:
        """One status of each process, as of the end."""
        found: dict[str, tuple[Status, ...]] = {}
        for name in (*robot_names(self._config.team.robots), PLANNER):
            out = None if self._last is None else self._last.outputs.get(name)
            mode, reason = ("", "") if out is None else (out.mode, out.reason)
            ms = np.array(self.planner_ms[name])
            found[name] = (
                Status(0, 0, mode, reason, self._config.estimator.kind, {}, {}, ms, np.zeros(0)),
            )
        return found
