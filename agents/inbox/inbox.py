"""What has reached an agent: decoded once, held until due, sorted for its next step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

from quadriga.agents.gait import step_ms
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
from quadriga.shared.messages import EStop, Event, Message, Plan, Reference, State, Truth
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.topics import (
    ESTOP,
    EVENT,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    REQUESTS,
    RESET,
    RESUME,
    SAMPLE_MS,
    STATE,
    STATUS,
    STOP,
    TRUTH,
    Topic,
)

Source = tuple[str, str]  # name of a topic, name of who sends it
Order = tuple[int, int]  # a tick, or the step and exchange of a plan
Due = tuple[Source, Order]  # a message of a source, and all before it
UNREADABLE: Final = "unreadable"  # reason of a stop whose message does not decode
_NEVER: Final = (-1, 0)
_HELD: Final = 256  # messages of one source beyond those of the stand; more can only be a flood


class Inbox:
    """The messages that an agent subscribes to, between the bus and its next step.

    In lock-step a message is handed over at the tick that expects it, never earlier, so what an
    agent knows at a tick does not depend on who was faster. In real time all that has come is
    handed over.

    Args:
        config: the team's configuration.
        robot: the agent's robot.
        peers: robots whose plans and measurements matter to it.

    Attributes:
        topics: row of the table and sender of every key that it subscribes to.
        counters: refused messages, states passed over and waits given up, by name.
        received: valid messages by topic and sender.
        refused: whether a valid message that is no state was refused: too many were held, or it
            is of a time too far ahead.
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
            **{word.key(team): (word, "") for word in REQUESTS},
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
        self.refused = False
        self._end = -1  # tick for which the end of the walk is announced; −1: for none
        self._newest: dict[Source, Order] = {}
        self._held: dict[str, list[tuple[str, Any]]] = {}  # sender and message by topic
        self._count: Counter[Source] = Counter()  # of these
        # In lock-step nobody asks for what peers measure while they stand until they walk.
        self._most = _HELD + config.gait.stand_ms // SAMPLE_MS
        self._step_ms = step_ms(config)
        self._newest_state = -1  # its tick
        self._measurable = measured_limits(config.robot)
        is_measurable(self._measurable, self._measurable)  # compiled, or loaded, now
        self._state: State | None = None
        self._sample_end: State | None = None  # older than `_state`
        self._requests: dict[Topic, Any] = {}  # the last of each
        self._released: Message | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """What to subscribe to."""
        return tuple(self.topics)

    def take(self, key: str, payload: bytes) -> None:
        """Take in a packet; one that is not a valid message is dropped and counted."""
        row = self.topics.get(key)
        if row is None:
            self.counters["dropped_foreign"] += 1
            return
        topic, sender = row
        message = decode_packet(topic, payload)
        if message is None or not _is_believable(message, self._robot, self._measurable):
            self.counters[f"dropped_{topic.name}"] += 1
            return
        if topic not in (STATE, EVENT, *REQUESTS) and self._is_ahead(message):
            self.counters[f"ahead_{topic.name}"] += 1
            self.refused = True
            return
        self.received[topic.name, sender] += 1
        self._keep(topic, sender, message)

    def _is_ahead(self, message: Message) -> bool:
        """Whether a message is of a time that nobody in the team can have reached.

        It would be held until then, and real messages would be late behind it.
        """
        tick = message.step * self._step_ms if isinstance(message, Plan) else message.tick
        return tick > max(self._newest_state, 0) + AHEAD_MS

    def _keep(self, topic: Topic, sender: str, message: Message) -> None:
        if isinstance(message, State):
            self._keep_newest(message)
        elif topic in REQUESTS:
            # What is said may come twice; a release may end no stop that was pressed meanwhile.
            if topic is not RESET or message != self._released:
                self._requests[topic] = message
            if topic is RESET:
                self._released = message
        elif isinstance(message, Event):
            if message.kind == "stop":
                self._end = min(message.tick, max(self._newest_state, 0) + AHEAD_MS)
        else:
            source = (topic.name, sender)
            if self._count[source] >= self._most:
                self.counters[f"flooded_{topic.name}"] += 1
                self.refused = True
                return
            self._held.setdefault(topic.name, []).append((sender, message))
            self._count[source] += 1
            self._newest[source] = max(self._newest.get(source, _NEVER), order_of(message))

    def _keep_newest(self, state: State) -> None:
        if state.tick <= self._newest_state:
            self.counters["states_passed_over"] += 1
            return
        self._newest_state = state.tick
        if state.tick > self._end:
            self._end = -1
        passed = self._state
        if passed is not None and passed.tick % SAMPLE_MS == 0:
            passed, self._sample_end = self._sample_end, passed
        if passed is not None:
            self.counters["states_passed_over"] += 1
        self._state = state

    @property
    def ended(self) -> bool:
        """Whether the end of the walk has been announced, and time has not gone on since."""
        return self._end >= 0

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
        limits: list[tuple[Topic, str, Order | None]] = [
            *((PLAN, name, expected.plan) for name in self._planners),
            *((MEASUREMENT, name, _tick(expected.measurement_tick)) for name in self._peers),
            (REFERENCE, OPERATOR, _tick(expected.reference_tick)),
            (TRUTH, SIM, _tick(tick if expected.truth else None)),
        ]
        return [
            ((topic.name, sender), limit) for topic, sender, limit in limits if limit is not None
        ]

    def missing_sources(self, tick: int, expected: Expected) -> frozenset[Source]:
        """Whose message, of which topic, for the step of `tick` has not come yet."""
        return frozenset(
            source
            for source, limit in self.list_due(tick, expected)
            if self._newest.get(source, _NEVER) < limit
        )

    def pop_inputs(self, state: State, expected: Expected) -> Inputs:
        """All that is due at the step of `state`, sorted by robot, then tick; it is removed."""
        if self._lockstep and expected is NOTHING and not self._requests:
            return Inputs(state)
        plans = self._pop_due(PLAN, expected.plan)
        measurements = self._pop_due(MEASUREMENT, _tick(expected.measurement_tick))
        references = self._pop_due(REFERENCE, _tick(expected.reference_tick))
        truths = self._pop_due(TRUTH, _tick(state.tick if expected.truth else None))
        statuses = self._pop_due(STATUS, None)
        requests, self._requests = self._requests, {}
        return Inputs(
            state,
            tuple(measurements),
            tuple(plans),
            tuple(reference for _, reference in references),
            requests.get(ESTOP),
            truths[-1][1] if truths else None,
            stop=requests.get(STOP),
            reset=requests.get(RESET),
            resume=requests.get(RESUME),
            statuses=tuple(statuses),
        )

    def _pop_due(self, topic: Topic, limit: Order | None) -> list[tuple[str, Any]]:
        """Take out the held messages of a topic up to `limit`."""
        held = self._held.get(topic.name)
        if not held or (self._lockstep and limit is None):
            return []
        due, later = held, []
        if self._lockstep and limit is not None:
            due = [item for item in held if order_of(item[1]) <= limit]
            later = [item for item in held if order_of(item[1]) > limit]
        self._held[topic.name] = later
        self._count.subtract((topic.name, sender) for sender, _ in due)
        return sorted(due, key=lambda item: (item[0], order_of(item[1])))


def decode_packet(topic: Topic, payload: bytes) -> Message | None:
    """The message in a packet, or None; whatever comes as an emergency stop is one."""
    try:
        return decode(payload, topic.type)
    except MessageError:
        return EStop(0, 0, UNREADABLE) if topic is ESTOP else None


def _is_believable(message: Message, robot: str, measurable: Array) -> bool:
    """Whether finite numbers can be meant, and for this robot.

    Sensors must be able to say what a state says, references be within limits, and the truth be of
    this robot and its orientation of unit length. Sensors may fail, see `agents.validate`.
    """
    if isinstance(message, State):
        return is_measurable(message.row, measurable)
    if isinstance(message, Truth):
        names, quats = message.robots, message.base_quat_wxyz
        if robot not in names or len(names) != len(quats):
            return False
        return is_orientation(quats[names.index(robot)])
    if isinstance(message, Reference):
        return is_within_limits(message)
    return True


def order_of(message: Message) -> Order:
    """Where a message stands among those of its source: by tick, or by step and exchange."""
    return message.serial if isinstance(message, Plan) else (message.tick, 0)


def _tick(tick: int | None) -> Order | None:
    return None if tick is None else (tick, 0)
