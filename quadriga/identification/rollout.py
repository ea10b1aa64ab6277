"""The whole team in one process, without a bus: data collection and anything that needs speed.

The same world and the same agents as over the bus, and the same bytes: messages are handed over as
they are, at the tick after they were sent or when they are due, as the bus does in lock-step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeVar

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.agents.planner.team import Collected, TeamPlanner
from quadriga.agents.planning.central import Central, CentralState
from quadriga.agents.planning.remote import central_latency
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.agent_command import KEY as CONTROLLER
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.members import PLANNER
from quadriga.shared.messages import Event, Measurement, Plan, Reference
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.sim_server.world.world import World

Plans = tuple[tuple[str, Plan], ...]
M = TypeVar("M", Measurement, Plan)


@dataclass(frozen=True, slots=True)
class Tick:
    """Everything that happened in one tick, for whoever watches a rollout."""

    tick: int
    outputs: Mapping[str, Outputs]
    events: tuple[Event, ...]


def build_agents(
    config: Config,
    predictor: Predictor | None,
    clock_ns: Callable[[], int] = lambda: 0,
    collected: Collected | None = None,
) -> dict[str, Agent]:
    """The team's agents by name; they remember nothing, so that they may walk again and again.

    Args:
        config: the team's configuration; they do not look at its world.
        predictor: for agents that plan for themselves, or None.
        clock_ns: read around their planners, for `Outputs.planner_ns` alone.
        collected: reads the collected episodes, for agents that plan with them.

    Raises:
        ConfigError: the team's agents are a controller of one's own, a process of its own.
    """
    if config.team.agent_command:
        raise ConfigError(
            CONTROLLER,
            repr(config.team.agent_command),
            "'': agents that walk in this process",
            "only `quadriga walk` and campaigns start a controller of one's own",
        )
    use_one_blas_thread()
    names = robot_names(config.team.robots)
    return {name: Agent(config, name, predictor, clock_ns, collected) for name in names}


class Rollout:
    """A world and its agents, advanced tick by tick.

    Args:
        config: the team's configuration.
        predictor: for agents that plan for themselves, or None.
        references: the reference that starts at a tick, or None.
        excitation: force deviation (12,) of a robot at a tick, or None; data collection only.
        planner: the planner of the whole team, if `planner.kind` is one process for all.
        agents: of the team, made before (`build_agents`); by default they are made now.
    """

    def __init__(
        self,
        config: Config,
        predictor: Predictor | None,
        references: Callable[[int], Reference | None],
        excitation: Callable[[str, int], Array] | None = None,
        planner: TeamPlanner | None = None,
        agents: Mapping[str, Agent] | None = None,
    ) -> None:
        use_one_blas_thread()
        self.world = World(config)
        self.agents = build_agents(config, predictor) if agents is None else dict(agents)
        self.states: dict[str, AgentState] = {n: a.initial() for n, a in self.agents.items()}
        self._references = references
        self._excitation = excitation
        self._measurements: tuple[tuple[str, Measurement], ...] = ()
        self._plans: Plans = ()
        self._by_truth = config.estimator.kind == "truth"
        self._central = None if planner is None else _CentralPlanner(config, planner)

    def ticks(self, count: int) -> Iterator[Tick]:
        """Advance by up to `count` ticks; stops early when a robot has fallen."""
        for _ in range(count):
            yield self.step()
            if self.world.fallen():
                return

    def step(self) -> Tick:
        """Advance one tick."""
        tick = self.world.tick
        states = self.world.states()
        truth = self.world.truth() if self._by_truth else None
        reference = self._references(tick)
        references = () if reference is None else (reference,)
        central: Mapping[str, Plans] = {}
        if self._central is not None:
            central = self._central.step(tick, self._measurements, references)
        measurements, plans = self._measurements, self._plans
        outputs: dict[str, Outputs] = {}
        for name, agent in self.agents.items():
            inputs = Inputs(
                states[name],
                measurements and _of_others(measurements, name),
                central.get(name) or (plans and _of_others(plans, name)),
                references,
                truth=truth,
                excitation=None if self._excitation is None else self._excitation(name, tick),
            )
            self.states[name], outputs[name] = agent.step(self.states[name], inputs)
        sent = outputs.items()
        self._measurements = tuple(
            [(name, out.measurement) for name, out in sent if out.measurement is not None]
        )
        self._plans = tuple([(name, out.plan) for name, out in sent if out.plan is not None])
        events = self.world.step({name: out.command for name, out in outputs.items()})
        return Tick(tick, outputs, events)


def _of_others(messages: tuple[tuple[str, M], ...], name: str) -> tuple[tuple[str, M], ...]:
    return tuple(item for item in messages if item[0] != name)


class _CentralPlanner:
    """The planner of the whole team; what it makes of the data of t is due its latency later."""

    def __init__(self, config: Config, planner: TeamPlanner) -> None:
        self._planning, self._state = Central(config, planner), CentralState()
        self._latency = central_latency(config)
        self._due: dict[int, Plans] = {}

    def step(
        self,
        tick: int,
        measurements: tuple[tuple[str, Measurement], ...],
        references: tuple[Reference, ...],
    ) -> dict[str, Plans]:
        """Take in what was sent at the tick before; the plans that are due now, by robot."""
        remembered = self._planning.remember(self._state, measurements, references)
        self._state, outputs = self._planning.step(remembered)
        if outputs.plans:
            self._due[outputs.plans[0][1].tick + self._latency] = outputs.plans
        return {name: ((PLANNER, plan),) for name, plan in self._due.pop(tick, ())}
