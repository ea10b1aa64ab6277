"""SHELL around whatever answers a robot's states: receive, step, publish."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import closing
from os import sched_yield
from typing import Any, Final, Protocol

import numpy as np

from quadriga.agents.agent import Acted, Agent
from quadriga.agents.inbox import Inbox, Source
from quadriga.agents.modes import change_event
from quadriga.agents.plain_ticks import PlainTicks
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.step_io import Inputs, Outputs
from quadriga.agents.telemetry import Telemetry
from quadriga.shared.bus.discovery import ProcessInfo, join, log
from quadriga.shared.bus.liveness import Loss, find_lost_link, loss_error
from quadriga.shared.bus.session import HERE, POLL, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.codes import LEAD_GONE, LINK_LOST
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import PEER_TIMEOUT
from quadriga.shared.link.agent_end import AgentEnd
from quadriga.shared.link.ticks import TickBatch
from quadriga.shared.messages import Command, Message, State
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.clock import log_ns, monotonic, monotonic_ns
from quadriga.shared.runtime.scheduling import at_work
from quadriga.shared.runtime.signals import interruptible
from quadriga.shared.topics import (
    AGENT_EVENT,
    INPUTS,
    MEASUREMENT,
    PLAN,
    STATE,
    STATUS,
    TICKS,
    TICKS_MS,
    Topic,
)

_TAU: Final = Command.CUTS["tau"]


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
    """Be a robot's agent until the walk ends or it is stopped.

    Args:
        config: the team's configuration.
        agent: answers the states.
        inbox: what reaches it.
        stopped: asked often whether to stop.
        rehearse: called once all are there. A stop interrupts it.
        predictor_sha256: digest of the predictor that it plans with; "": none.

    Raises:
        BusError: the bus cannot be opened, the plant refuses the agent, or the team is not complete
            in time, has something else in common, or walks already.
        ProcessError: the plant has vanished.
        KeyboardInterrupt: it is stopped before it is ready.
    """
    with Bus.open(config.bus, config.team.name, agent.robot, stopped) as bus:
        for key, (topic, _) in inbox.topics.items():
            if topic is not STATE:  # which comes over the link
                bus.subscribe(key)
        with closing(AgentEnd(config, agent.robot, bus)) as link:
            if not join(bus, config, stopped, ProcessInfo(bus, config, predictor_sha256)):
                return
            if not link.open(stopped):
                return
            with interruptible(stopped):
                rehearse()
            shell = AgentShell(config, agent, inbox, bus, link)
            with at_work(config.runtime.priority):
                bus.declare(READY)
                shell.walk(stopped)


class AgentShell:
    """The loop around an agent's `step`."""

    def __init__(
        self, config: Config, agent: SteppedAgent, inbox: Inbox, bus: Bus, link: AgentEnd
    ) -> None:
        team, self._lockstep = config.team.name, config.world.mode == "lockstep"
        self._config, self._agent, self._inbox = config, agent, inbox
        self._bus, self._link = bus, link
        self._put = {
            topic: bus.publisher(topic.key(team, agent.robot), waits=self._lockstep)
            for topic in (MEASUREMENT, PLAN, STATUS, INPUTS, TICKS)
        }
        event = AGENT_EVENT.key(team, agent.robot)
        self._put[AGENT_EVENT] = bus.publisher(event, urgent=not self._lockstep)
        self._telemetry = Telemetry(config.estimator.kind, paced=not self._lockstep)
        self._given_up: dict[Source, int] = {}  # messages received of a source when given up
        self._plain = PlainTicks(agent) if isinstance(agent, Agent) else None
        self._memory = agent.initial()
        # Tick, state and command of the last ones, for the recording if the plant is killed.
        self._lately: deque[tuple[int, int, bytes, bytes]] = deque(maxlen=2 * TICKS_MS)

    def walk(self, stopped: Callable[[], bool]) -> None:
        """Answer every state until the walk is over.

        Raises:
            ProcessError: the plant, or the link to the router, has vanished.
        """
        inbox, link, walks = self._inbox, self._link, False
        while not (stopped() or link.ended):
            # In real time there may be newer ones. In lock-step there are none before the answer.
            if not (self._lockstep and inbox.has_state):
                came = link.receive(wait=not inbox.has_state)
                if came and not walks:
                    walks = True
                    log(f"{self._agent.robot}: the team walks")
                if came and self._answer_plainly():
                    continue
                if came:
                    got = link.received
                    inbox.take_state(State.from_row(got.tick, got.stamp_ns, got.state.copy()))
                    continue
                if link.malformed:
                    inbox.counters[f"dropped_{STATE.name}"] += link.malformed
                    link.malformed = 0
                if link.closed:
                    self._end_without_plant()
            self._take_mail()
            state = inbox.pop_state()
            if state is not None:
                self._memory = self._step(self._memory_now(), state)
        if link.ended == LINK_LOST:
            self._end_without_plant()

    def _memory_now(self) -> Any:
        """What the agent remembers: behind the plain ticks since its last step, if there are."""
        return self._plain.state or self._memory if self._plain is not None else self._memory

    def _take_mail(self, timeout: float = 0.0) -> None:
        """Take in all that has come over the bus, or comes within `timeout` seconds."""
        first = self._bus.get(timeout)
        if first is not None:
            self._inbox.take(*first)
            for packet in self._bus.drain():
                self._inbox.take(*packet)

    def _answer_plainly(self) -> bool:
        """Answer the state that has just come by a plain tick, if it is one."""
        plain, inbox, received = self._plain, self._inbox, self._link.received
        tick, begun = received.tick, monotonic_ns()
        if plain is None or not plain.answers(tick) or inbox.has_state:
            return False
        self._take_mail()
        due = plain.is_due(tick) or inbox.holds_due
        if inbox.holds_commands or (due and self._commands_wait(plain, tick)):
            return False
        tau = plain.answer(tick, received.state)
        if tau is None:
            return False
        row = self._link.command.row
        row[:] = 0.0
        row[_TAU] = tau
        self._send(tick, received.state)
        inbox.pass_state(tick)
        if due:
            sched_yield()  # another robot's answer is due before this one's plan
            state = State.from_row(tick, 1_000_000 * tick, received.state.copy())
            self._memory = self._step(self._memory_now(), state, plain.acted, begun)
        else:
            plain.keep()
            self._telemetry.note_state(tick, begun)
            self._telemetry.note_answer(monotonic_ns() - begun)
        return True

    def _commands_wait(self, plain: PlainTicks, tick: int) -> bool:
        """Whether the command of a tick depends on messages that are taken in at it."""
        expected = self._agent.expected(tick) if self._lockstep else NOTHING
        return plain.plans_at_once or expected.reference_tick is not None or expected.truth

    def _send(self, tick: int, state: Array) -> None:
        """Send the command of a tick, whose row is filled."""
        command = self._link.command
        self._link.send(command.stamp(tick, 1_000_000 * tick))
        self._lately.append((log_ns(), tick, state.tobytes(), command.row.tobytes()))

    def _step(
        self, memory: Any, state: State, acted: Acted | None = None, answered_ns: int = 0
    ) -> Any:
        """One tick: wait for what is due, step, publish.

        `acted` is what a state has come to that has been answered, `answered_ns` when it had come.
        """
        tick, begun = state.tick, answered_ns or monotonic_ns()
        self._telemetry.note_state(tick, begun)
        if acted is not None:
            self._telemetry.note_answer(monotonic_ns() - begun)
        expected = self._agent.expected(tick)
        if self._lockstep and expected is not NOTHING:
            self._await_messages(tick, expected)
        inputs = self._inbox.pop_inputs(state, expected, answered=acted is not None)
        if acted is not None and self._plain is not None:
            after, outputs = self._plain.agent.finish_step(memory, inputs, acted)
        else:
            after, outputs = self._agent.step(memory, inputs)
            self._link.command.row[:] = outputs.command.row
            self._send(tick, state.row)
            self._telemetry.note_answer(monotonic_ns() - begun)
        self._telemetry.note_step(outputs)
        self._publish(MEASUREMENT, outputs.measurement)
        self._publish(PLAN, outputs.plan)
        self._publish(STATUS, self._telemetry.status(tick, outputs, self._inbox.counters))
        self._publish(INPUTS, self._inbox.record(memory.tick, inputs, expected))
        self._publish(AGENT_EVENT, change_event(memory.mode, after.mode, tick, self._agent.robot))
        if self._plain is not None:
            self._plain.arm(after)
        return after

    def _publish(self, topic: Topic, message: Message | None) -> None:
        if message is not None:
            self._put[topic](encode(message))

    def _end_without_plant(self) -> None:
        """Tell a recorder what the plant has no longer told, and end.

        Raises:
            ProcessError: always.
        """
        config, robot, tick = self._config, self._agent.robot, 0
        batch = TickBatch((robot,))
        for at, tick, state, command in self._lately:
            batch.add_state(robot, tick, np.frombuffer(state), at)
            batch.add_command(robot, tick, np.frombuffer(command), at)
        self._publish(TICKS, batch.take(tick))
        loss = find_lost_link(self._bus, config)
        if loss is None and self._link.ended:
            loss = Loss(LINK_LOST, f"link of {self._link.plant} to the router")
        name = f"process {self._link.plant} of team {self._bus.team!r}, seen by {robot}"
        raise loss_error(loss or Loss(LEAD_GONE, name), tick)

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
            self._take_mail(min(left, POLL))

    def _missing_sources(self, tick: int, expected: Expected) -> set[Source]:
        """Sources that have not sent their message yet and are worth waiting for."""
        received, present = self._inbox.received, self._bus.members_at(HERE)
        return {
            source
            for source in self._inbox.missing_sources(tick, expected)
            if source[1] in present and self._given_up.get(source) != received[source]
        }
