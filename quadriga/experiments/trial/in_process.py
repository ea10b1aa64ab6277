"""A trial's walk in this process, without a bus: the same code and the same bytes as over it."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.agent import Agent
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.team import Collected, TeamPlanner, TeamResult
from quadriga.agents.predictor.predictor import Predictor
from quadriga.experiments.trial.figures_of_merit import Walk
from quadriga.identification.rollout import Rollout, Tick, build_agents
from quadriga.recordings.traces import MeasurementTrace, Traces
from quadriga.recordings.truth import build_truth_trace, ticks_of
from quadriga.shared.config.sections import Config
from quadriga.shared.members import PLANNER
from quadriga.shared.messages import Event, Measurement, Status, Truth
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.shared.runtime.scheduling import collector_off
from quadriga.shared.topics import REFERENCE_EPOCH_MS, SAMPLE_MS
from quadriga.sim_server.world.layout import NV
from quadriga.sim_server.world.world import World
from quadriga.team.operator import reference_at, references_of

_SUMMED: Final = 100  # ticks whose work is summed up at once


def build_timed_agents(
    config: Config, predictor: Predictor | None, collected: Collected | None = None
) -> dict[str, Agent]:
    """The team's agents by name, whose planners are timed; they may walk again and again.

    Args:
        config: the team's configuration; they do not look at its world.
        predictor: None without a planner.
        collected: reads the collected episodes, for agents that plan with them.
    """
    of_agents = predictor if find_kind(config.planner.kind).agents_predict else None
    return build_agents(config, of_agents, monotonic_ns, collected)


def roll_out(
    config: Config,
    agents: Mapping[str, Agent],
    planner: TeamPlanner | None,
    watch: Callable[[Tick], None] | None = None,
) -> Walk:
    """Walk in this process, until `world.duration` are over or a robot has fallen.

    Args:
        config: the team's configuration.
        agents: of the team, see `build_timed_agents`.
        planner: of the whole team, for the kinds of planner that are one process.
        watch: shown every tick.
    """
    timed = None if planner is None else _TimedPlanner(planner)
    rollout = Rollout(config, None, references_of(config), planner=timed, agents=agents)
    log, meter = _WalkLog(config), _WorkMeter(rollout.world)
    last = round(1000 * config.world.duration)
    with collector_off():
        while rollout.world.tick < last and not rollout.world.fallen():
            if rollout.world.tick % SAMPLE_MS == 0:
                log.truth.append(rollout.world.truth())
            tick = rollout.step()
            log.add(tick)
            meter.add_tick()
            if watch is not None:
                watch(tick)
    if timed is not None:
        log.planner_ms[PLANNER] = timed.ms
        log.plans += timed.plans
    return replace(log.build_walk(), work=meter.work)


class _TimedPlanner(TeamPlanner):
    """A team's planner that notes how long each step took and what came of it."""

    def __init__(self, planner: TeamPlanner) -> None:
        self._planner = planner
        self.ms: list[float] = []
        self.plans: Counter[str] = Counter()

    def step(self, inputs: Sequence[PlannerInputs]) -> TeamResult:
        begun = monotonic_ns()
        result = self._planner.step(inputs)
        self.ms.append(1e-6 * (monotonic_ns() - begun))
        self.plans[result.status] += len(inputs)
        return result


class _WorkMeter:
    """Sums up what the motors do.

    A tick moves the joints by their rates at its end under the torques that acted in it, so that
    the sum is the work itself, not an approximation of it. The torques are the motors', of which
    friction takes its part before the joints have the rest.
    """

    def __init__(self, world: World) -> None:
        n, physics = len(world.names), world.physics
        self._torque = world.motors.torque
        # A view of MuJoCo's own memory.
        self._rate = physics.qvel[: n * NV].reshape(n, NV)[:, 6:]
        self._power = np.empty((_SUMMED, n, NV - 6))  # of the last ticks, W
        self._count = 0  # of these
        self._work = 0.0

    def add_tick(self) -> None:
        """Add the tick that has just been walked."""
        if self._count == _SUMMED:
            self._sum_up()
        np.multiply(self._torque, self._rate, out=self._power[self._count])
        self._count += 1

    @property
    def work(self) -> float:
        """Of all ticks so far, J."""
        self._sum_up()
        return self._work

    def _sum_up(self) -> None:
        ticks = np.abs(self._power[: self._count]).reshape(self._count, self._power[0].size)
        for power in ticks.sum(axis=1).tolist():
            self._work += 1e-3 * power
        self._count = 0


class _WalkLog:
    """What is seen of a walk in this process."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self.truth: list[Truth] = []
        self.events: list[Event] = []
        self.samples: defaultdict[str, list[Measurement]] = defaultdict(list)
        self.planner_ms: defaultdict[str, list[float]] = defaultdict(list)
        self.plans: Counter[str] = Counter()
        self._last: Tick | None = None

    def add(self, tick: Tick) -> None:
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

    def build_walk(self) -> Walk:
        """All of it, in the form that a recording is read in."""
        config = self._config
        names = robot_names(config.team.robots)
        references = [
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
            references=(
                ticks_of(references),
                np.array([[r.vx, r.vy, r.wz, r.height] for r in references]),
            ),
            measurements={
                name: MeasurementTrace(ticks_of(of_robot), np.array([s.y for s in of_robot]))
                for name, of_robot in samples.items()
            },
            plans={name: () for name in names},
            statuses=self._statuses(),
            events=tuple(self.events),
        )
        return Walk(traces, samples, self.plans)

    def _statuses(self) -> dict[str, tuple[Status, ...]]:
        """One status of each process, as of the end."""
        statuses: dict[str, tuple[Status, ...]] = {}
        for name in (*robot_names(self._config.team.robots), PLANNER):
            out = None if self._last is None else self._last.outputs.get(name)
            mode, reason = ("", "") if out is None else (out.mode, out.reason)
            ms = np.array(self.planner_ms[name])
            statuses[name] = (
                Status(0, 0, mode, reason, self._config.estimator.kind, {}, {}, ms, np.zeros(0)),
            )
        return statuses
