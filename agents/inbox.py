"""What has reached an agent: decoded once, held until due, sorted for its next step.

What it took in at which tick is recorded wherever the rules do not determine it.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any, Final

from quadriga.agents.gait import step_ms
from quadriga.agents.planner.peers import order_of as order_of
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.planning.references import AHEAD_MS
from quadriga.agents.plausibility import (
    is_measurable,
    is_orientation,
    is_within_limits,
    measured_limits,
)
from quadriga.agents.step_io import Inputs
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.members import OPERATOR, PLANNER, SIM
from quadriga.shared.messages import Consumed, EStop, Event, Message, Plan, Reference, State, Truth
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import (
    ESTOP,
    EVENT,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    REFERENCE_EPOCH_MS,
    REQUESTS,
    RESET,
    SAMPLE_MS,
    STATE,
    STATUS,
    TRUTH,
    Topic,
)

Source = tuple[str, str]  # name of a topic, name of who sends it
Order = tuple[int, int]  # a tick, or the step and exchange of a plan
Due = tuple[Source, Order]  # a message of a source, and all before it
UNREADABLE: Final = "unreadable"  # reason of a stop whose message does not decode
ANYONE: Final = "anyone"  # who stopped the team, released a stop or had it go on
_NEVER: Final = (-1, 0)
_HELD: Final = 256  # messages of one source beyond those of the stand; more can only be a flood
_COMMANDING: Final = frozenset((REFERENCE.name, TRUTH.name))
_ASKED_FOR: Final = frozenset(topic.name for topic in REQUESTS)


class Inbox:
    """The messages that an agent subscribes to, between the bus and its next step.

    In lock-step a message is handed over at the tick that expects it, never earlier, so what an
    agent knows at a tick does not depend on who was faster. In real time all that has come is
    handed over.

    Plans and measurements of `peers` matter to it.

    Attributes:
        topics: row of the table and sender of every key that it subscribes to.
        counters: refused messages, states passed over and waits given up, by name.
        received: valid messages by topic and sender.
        refused: whether a valid message that is no state was refused: too many were held, or it
            is of a time too far ahead.
        ended: whether the end of the walk has been announced, and time has not gone on since, but
            for what plants of single robots may be apart.
    """

    def __init__(self, config: Config, robot: str, peers: Sequence[str]) -> None:
        team, central = config.team.name, find_kind(config.planner.kind).central
        self._robot = robot
        self._lockstep = config.world.mode == "lockstep"
        self._peers, self._planners = tuple(peers), (PLANNER,) if central else tuple(peers)
        self.topics: dict[str, tuple[Topic, str]] = {
            STATE.key(team, robot): (STATE, robot),
            REFERENCE.key(team): (REFERENCE, OPERATOR),
            EVENT.key(team): (EVENT, SIM),
            **{topic.key(team): (topic, ANYONE) for topic in REQUESTS},
        }
        if config.estimator.kind == "truth":
            self.topics[TRUTH.key(team)] = (TRUTH, SIM)
        if central:
            self.topics[PLAN.key(team, robot)] = (PLAN, PLANNER)
        if not self._lockstep:
            for name in robot_names(config.team.robots):
                if name != robot:
                    self.topics[STATUS.key(team, name)] = (STATUS, name)
        for peer in self._peers:
            self.topics[PLAN.key(team, peer)] = (PLAN, peer)
            self.topics[MEASUREMENT.key(team, peer)] = (MEASUREMENT, peer)
        self.counters: Counter[str] = Counter()
        self.received: Counter[Source] = Counter()
        self.refused = self.ended = False
        self._end = -1  # tick for which the end of the walk is announced
        apart = config.team.plant_per_robot and not self._lockstep
        self._apart_ms = round(1e3 * config.bus.clock_timeout) if apart else 0
        self._newest: dict[Source, Order] = {}
        self._held: defaultdict[Source, list[Any]] = defaultdict(list)
        # In lock-step nobody asks for what peers measure while they stand until they walk.
        self._most = _HELD + config.gait.stand_ms // SAMPLE_MS
        self._step_ms = step_ms(config)
        self._newest_state = -1  # its tick
        self._measurable = measured_limits(config.robot)
        is_measurable(self._measurable, self._measurable)  # compiled, or loaded, now
        self._state: State | None = None
        self._sample_end: State | None = None  # older than `_state`
        self._requests: dict[str, Any] = {}  # the last of each
        self._released: Message | None = None
        self._records = 0
        self._handed_over: dict[Source, Order] = {}  # in lock-step: up to where

    def take(self, key: str, payload: bytes) -> None:
        """Take in a packet; one that is not a valid message is dropped and counted."""
        row = self.topics.get(key)
        if row is None:
            self.counters["dropped_foreign"] += 1
            return
        topic, sender = row
        message = decode_packet(topic, payload)
        if isinstance(message, State):
            self.take_state(message)
            return
        if message is None or not self._is_believable(message):
            self.counters[f"dropped_{topic.name}"] += 1
            return
        source = (topic.name, sender)
        if topic in REQUESTS:
            # What is said may come twice; a release may end no stop that was pressed meanwhile.
            if topic is not RESET or message != self._released:
                self._requests[topic.name] = message
            if topic is RESET:
                self._released = message
        elif isinstance(message, Event):
            if message.kind == "stop":
                self._end, self.ended = min(message.tick, self._latest), True
        elif self._latest < (
            message.step * self._step_ms if isinstance(message, Plan) else message.tick
        ):
            # It would be held until then, and real messages would be late behind it.
            self.counters[f"ahead_{topic.name}"] += 1
            self.refused = True
            return
        elif len(self._held[source]) >= self._most:
            self.counters[f"flooded_{topic.name}"] += 1
            self.refused = True
        else:
            self._held[source].append(message)
            self._newest[source] = max(self._newest.get(source, _NEVER), order_of(message))
        self.received[source] += 1

    def take_state(self, state: State) -> None:
        """Take in a state, if it is the newest and sensors can say it; see `agents.validate`."""
        if not is_measurable(state.row, self._measurable):
            self.counters[f"dropped_{STATE.name}"] += 1
            return
        if state.tick <= self._newest_state:
            self.counters["states_passed_over"] += 1
            return
        self.pass_state(state.tick)
        passed, self._state = self._state, state
        if passed is not None and passed.tick % SAMPLE_MS == 0:
            passed, self._sample_end = self._sample_end, passed
        if passed is not None:
            self.counters["states_passed_over"] += 1

    def pass_state(self, tick: int) -> None:
        """Note a state that has been answered already."""
        self._newest_state = tick
        self.ended = self.ended and tick <= self._end + self._apart_ms

    @property
    def holds_commands(self) -> bool:
        """Whether there is anything that changes what the robot does at the next tick."""
        return bool(self._requests) or (
            not self._lockstep and any(source[0] in _COMMANDING for source in self._held)
        )

    @property
    def holds_due(self) -> bool:
        """Whether there is anything that the next step takes in, whatever it expects."""
        return bool(self._requests) or (not self._lockstep and bool(self._held))

    @property
    def _latest(self) -> int:
        """The tick that nobody in the team can have passed."""
        return max(self._newest_state, 0) + AHEAD_MS

    def _is_believable(self, message: Message) -> bool:
        """Whether finite numbers can be meant, and for this robot.

        References must be within limits, and the truth be of this robot and its orientation of unit
        length.
        """
        if isinstance(message, Truth):
            names, quats = message.robots, message.base_quat_wxyz
            if self._robot not in names or len(names) != len(quats):
                return False
            return is_orientation(quats[names.index(self._robot)])
        return not isinstance(message, Reference) or is_within_limits(message)

    @property
    def has_state(self) -> bool:
        """Whether there is a state to answer."""
        return self._state is not None

    def pop_state(self) -> State | None:
        """The newest state, once; before it that at which a sample ends, if it was passed over.

        Ticks only rise. A missing sample would leave the planner without a window for long.
        """
        if self._sample_end is not None:
            passed, self._sample_end = self._sample_end, None
            return passed
        state, self._state = self._state, None
        return state

    def list_due(self, tick: int, expected: Expected) -> list[Due]:
        """The last message of each source that the step of `tick` waits for."""
        limits = _limits(tick, expected)
        sources = [
            *((PLAN.name, name) for name in self._planners),
            *((MEASUREMENT.name, name) for name in self._peers),
            (REFERENCE.name, OPERATOR),
            (TRUTH.name, SIM),
        ]
        return [(source, limits[source[0]]) for source in sources if source[0] in limits]

    def missing_sources(self, tick: int, expected: Expected) -> frozenset[Source]:
        """Whose message, of which topic, for the step of `tick` has not come yet."""
        return frozenset(
            source
            for source, limit in self.list_due(tick, expected)
            if self._newest.get(source, _NEVER) < limit
        )

    def pop_inputs(self, state: State, expected: Expected, *, answered: bool = False) -> Inputs:
        """All that is due at the step of `state`, sorted by robot, then tick; it is removed.

        Of a state that is `answered` already what people ask for is left for the next step: it
        would change the command.
        """
        due_later = not self._held or (self._lockstep and expected is NOTHING)
        if due_later and not self._requests:
            return Inputs(state)
        limits, due = _limits(state.tick, expected), defaultdict[str, list[tuple[str, Any]]](list)
        for source in sorted(self._held):
            topic, sender = source
            if self._lockstep and topic not in limits:
                continue
            held = sorted(self._held.pop(source), key=order_of)
            later = [m for m in held if self._lockstep and order_of(m) > limits[topic]]
            if later:
                self._held[source] = later
            due[topic] += ((sender, message) for message in held[: len(held) - len(later)])
        requests = {} if answered else self._requests
        self._requests = self._requests if answered else {}
        return Inputs(
            state,
            measurements=tuple(due[MEASUREMENT.name]),
            plans=tuple(due[PLAN.name]),
            references=tuple(reference for _, reference in due[REFERENCE.name]),
            truth=due[TRUTH.name][-1][1] if due[TRUTH.name] else None,
            statuses=tuple(due[STATUS.name]),
            **requests,
        )

    def record(self, last: int, inputs: Inputs, expected: Expected) -> Consumed | None:
        """The record of what one step took in, if one is due.

        In real time what an agent knew depends on who was faster: one is due at every step that
        took in more than the state after the last one. In lock-step one is due when a message was
        missing or came too late for the step that expected it, when a state was passed over, once a
        valid message was refused, and for every message that no rule expects.

        `last` is the tick of the step before, −1 before the first. Nothing has been taken in since
        the `inputs` of this one.
        """
        tick = inputs.state.tick
        if tick == last + 1 and expected is NOTHING and inputs.bare:
            return None
        taken, owed = list_messages(inputs), frozenset[Source]()
        unusual = bool(taken)
        if self._lockstep:
            by_rule = (
                has_rule(source, order) and order > self._handed_over.get(source, _NEVER)
                for source, order in taken
            )
            unusual = self.refused or not all(by_rule)
            if expected != NOTHING:
                owed = self.missing_sources(tick, expected)
                self._handed_over.update(self.list_due(tick, expected))
        if not (unusual or owed or tick != last + 1):
            return None
        self._records += 1
        return Consumed(
            tick,
            tick * 1_000_000,
            self._records - 1,
            tick - last - 1,
            tuple(format_message_id(*item) for item in taken),
            tuple(sorted("/".join(source) for source in owed)),
        )


def _limits(tick: int, expected: Expected) -> dict[str, Order]:
    """The last message that the step of `tick` takes in, by the name of its topic."""
    limits = {} if expected.plan is None else {PLAN.name: expected.plan}
    if expected.measurement_tick is not None:
        limits[MEASUREMENT.name] = expected.measurement_tick, 0
    if expected.reference_tick is not None:
        limits[REFERENCE.name] = expected.reference_tick, 0
    return limits | ({TRUTH.name: (tick, 0)} if expected.truth else {})


def decode_packet(topic: Topic, payload: bytes) -> Message | None:
    """The message in a packet, or None; whatever comes as an emergency stop is one."""
    try:
        return decode(payload, topic.type)
    except MessageError:
        return EStop(0, 0, UNREADABLE) if topic is ESTOP else None


def has_rule(source: Source, order: Order) -> bool:
    """Whether the rules of lock-step speak of such a message.

    They know nothing of what people ask for, nor of a second operator's references between those
    of the first.
    """
    if source[0] == REFERENCE.name:
        return order[0] % REFERENCE_EPOCH_MS == 0
    return source[0] not in _ASKED_FOR


def list_messages(inputs: Inputs) -> list[tuple[Source, Order]]:
    """Source and order of every message of a step but the state."""
    requests = zip(REQUESTS, inputs.requests, strict=True)
    messages: list[tuple[str, str, Message | None]] = [
        *((PLAN.name, name, plan) for name, plan in inputs.plans),
        *((MEASUREMENT.name, name, sample) for name, sample in inputs.measurements),
        *((REFERENCE.name, OPERATOR, reference) for reference in inputs.references),
        *((STATUS.name, name, status) for name, status in inputs.statuses),
        *((topic.name, ANYONE, request) for topic, request in requests),
        (TRUTH.name, SIM, inputs.truth),
    ]
    return [((topic, sender), order_of(m)) for topic, sender, m in messages if m is not None]


def format_message_id(source: Source, order: Order) -> str:
    """How `Consumed` refers to a message: `plan:r1:12.0`, `measurement:r1:480`."""
    topic, sender = source
    serial = f"{order[0]}.{order[1]}" if topic == PLAN.name else str(order[0])
    return f"{topic}:{sender}:{serial}"


def parse_message_id(text: str) -> tuple[Source, Order] | None:
    """The inverse of `format_message_id`; None for what it never writes."""
    parts = text.split(":")
    serial = parts[-1].split(".")
    if len(parts) != 3 or len(serial) > 2 or not all(part.isdecimal() for part in serial):
        return None
    step, exchange = (*serial, "0")[:2]
    return (parts[0], parts[1]), (int(step), int(exchange))
