"""SHELL around whatever answers a robot's states: receive, step, publish."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from quadriga.agents.inbox import Inbox, Source
from quadriga.agents.modes import change_event
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.step_io import Inputs, Outputs
from quadriga.agents.telemetry import Telemetry
from quadriga.shared.bus.discovery import ProcessInfo, join
from quadriga.shared.bus.liveness import Liveness
from quadriga.shared.bus.session import HERE, POLL, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import PEER_TIMEOUT
from quadriga.shared.messages import Message, State
from quadriga.shared.runtime.clock import monotonic, monotonic_ns
from quadriga.shared.runtime.scheduling import at_work
from quadriga.shared.runtime.signals import interruptible
from quadriga.shared.topics import AGENT_EVENT, COMMAND, INPUTS, MEASUREMENT, PLAN, STATUS, Topic


class SteppedAgent(Protocol):
    """Whatever answers the states of `robot`, tick by tick: `Agent`, or a user's own function.

    `expected` is what lock-step waits for before the step of a tick. Of all that it remembers from
    one step to the next the shell looks at the last `tick`, −1 before the first, and at the `mode`.
    """

    robot: str

    def initial(self) -> Any: ...

    def expected(self, tick: int) -> Expected: ...

    def step(self, state: Any, inputs: Inputs) -> tuple[Any, Outputs]: ...


def answer_states(
    config: Config,
    agent: SteppedAgent,
    inbox: Inbox,
    stopped: Callable[[], bool],
    rehearse: Callable[[], None],
    predictor_sha256: str = "",
) -> None:
    """Be a robot's agent on the bus until the walk ends or it is stopped.

    Args:
        config: the team's configuration.
        agent: answers the states.
        inbox: what reaches it.
        stopped: asked often whether to stop.
        rehearse: called once all are there. A stop interrupts it.
        predictor_sha256: digest of the predictor that it plans with; "": none.

    Raises:
        BusError: the bus cannot be opened, or the team is not complete in time, has something
            else in common, or walks already.
        ProcessError: who drives time, or the link to the router, has vanished.
        KeyboardInterrupt: it is stopped before it is ready.
    """
    with Bus.open(config.bus, config.team.name, agent.robot, stopped) as bus:
        for key in inbox.topics:
            bus.subscribe(key)
        if not join(bus, config, stopped, ProcessInfo(bus, config, predictor_sha256)):
            return
        with interruptible(stopped):
            rehearse()
        shell = AgentShell(config, agent, inbox, bus)
        with at_work(config.runtime.priority):
            bus.declare(READY)
            shell.walk(stopped)


class AgentShell:
    """The loop around an agent's `step`."""

    def __init__(self, config: Config, agent: SteppedAgent, inbox: Inbox, bus: Bus) -> None:
        team, realtime = config.team.name, config.world.mode == "realtime"
        self._config, self._agent, self._inbox, self._bus = config, agent, inbox, bus
        self._lockstep = not realtime
        self._put = {
            topic: bus.publisher(topic.key(team, agent.robot), droppable=realtime)
            for topic in (COMMAND, MEASUREMENT, PLAN, STATUS, INPUTS)
        }
        self._put[AGENT_EVENT] = bus.publisher(AGENT_EVENT.key(team, agent.robot), urgent=realtime)
        self._telemetry = Telemetry(config.estimator.kind, paced=realtime)
        self._lead = Liveness(bus, config)
        self._given_up: dict[Source, int] = {}  # messages received of a source when given up

    def walk(self, stopped: Callable[[], bool]) -> None:
        """Answer every state until the walk is over."""
        memory = self._agent.initial()
        while not (stopped() or self._lead.is_over(announced=self._inbox.ended)):
            self._receive(0.0 if self._inbox.has_state else POLL)
            state = self._inbox.pop_state()
            if state is not None:
                memory = self._answer(memory, state)
                self._lead.receive()
            else:
                self._lead.poll(memory.tick)

    def _receive(self, timeout: float) -> None:
        """Take in all that has come, or comes within `timeout` seconds."""
        first = self._bus.get(timeout)
        if first is not None:
            self._inbox.take(*first)
            for packet in self._bus.drain():
                self._inbox.take(*packet)

    def _answer(self, memory: Any, state: State) -> Any:
        """One tick: wait for what is due, step, publish."""
        tick, begun = state.tick, monotonic_ns()
        self._telemetry.note_state(tick, begun)
        expected = self._agent.expected(tick)
        if self._lockstep and expected is not NOTHING:
            self._await_messages(tick, expected)
        inputs = self._inbox.pop_inputs(state, expected)
        after, outputs = self._agent.step(memory, inputs)
        self._publish(COMMAND, outputs.command)
        self._telemetry.note_step(outputs, monotonic_ns() - begun)
        self._publish(MEASUREMENT, outputs.measurement)
        self._publish(PLAN, outputs.plan)
        self._publish(STATUS, self._telemetry.status(tick, outputs, self._inbox.counters))
        self._publish(INPUTS, self._inbox.record(memory.tick, inputs, expected))
        self._publish(AGENT_EVENT, change_event(memory.mode, after.mode, tick, self._agent.robot))
        return after

    def _publish(self, topic: Topic, message: Message | None) -> None:
        if message is not None:
            self._put[topic](encode(message))

    def _await_messages(self, tick: int, expected: Expected) -> None:
        """Wait for the messages that a step expects.

        A source that is silent for the time-out is not waited for again until it sends a message.
        """
        deadline, received = monotonic() + PEER_TIMEOUT, self._inbox.received
        while missing := self._missing_sources(tick, expected):
            left = deadline - monotonic()
            if left <= 0.0:
                self._given_up |= {source: received[source] for source in missing}
                self._inbox.counters["waits_given_up"] += 1
                return
            self._receive(min(left, POLL))

    def _missing_sources(self, tick: int, expected: Expected) -> set[Source]:
        """Sources that have not sent their message yet and are worth waiting for."""
        received, present = self._inbox.received, self._bus.members_at(HERE)
        return {
            source
            for source in self._inbox.missing_sources(tick, expected)
            if source[1] in present and self._given_up.get(source) != received[source]
        }
