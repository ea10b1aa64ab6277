"""What has reached an agent: decoded once, held until due, sorted for its next step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

from quadriga.agents.agent import Inputs
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.planning.operator_references import AHEAD_MS
from quadriga.agents.plausibility import is_orientation, is_within_limits
from quadriga.agents.time_grid import step_ms
from quadriga.shared.bus.members import OPERATOR, PLANNER, SIM
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.errors import MessageError
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import EStop, Event, Message, Plan, Reference, State, Truth
from quadriga.shared.wire.topics import (
    ESTOP,
    EVENT,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    SAMPLE_MS,
    STATE,
    TRUTH,
    Topic,
)

Source = tuple[str, str]  # name of a topic, name of who sends it
Order = tuple[int, int]  # a tick, or the step and exchange of a plan
Wanted = tuple[Source, Order]  # a message of a source, and all before it
UNREADABLE: Final = "unreadable"  # reason of a stop whose message does not decode
_NEVER: Final = (-1, 0)
_HELD: Final = 256  # messages of one source beyond those of the stand; more can only be a flood
_JUMP_MS: Final = 5000  # from one state to the next; longer than any silence the team survives


class Inbox:
    """The messages that an agent subscribes to, between the bus and its next step.

    In lock-step a message is handed over at the tick that awaits it, never earlier: then what an
    agent knew at each tick does not depend on who was faster. In real time all that has come is
    handed over.

    Args:
        config: the team's configuration.
        robot: the agent's robot.
        peers: robots whose plans and measurements matter to it.

    Attributes:
        topics: row of the table and sender of every key that it subscribes to.
        counters: refused messages, states passed over and waits given up, by name.
        heard: valid messages by topic and sender.
        refused: whether a valid message but a state was refused: too many were held, or it is of
            a time too far ahead.
        misfits: states since the newest one that were not newer, or too far ahead.
        ended: whether the world has said that the walk is over.
    """

    def __init__(self, config: Config, robot: str, peers: Sequence[str]) -> None:
        team, central = config.team.name, config.planner.kind in CENTRAL
        self._robot = robot
        self._lockstep = config.world.mode == "lockstep"
        self._peers, self._planners = tuple(peers), (PLANNER,) if central else tuple(peers)
        self.topics: dict[str, tuple[Topic, str]] = {
            STATE.key(team, robot): (STATE, robot),
            REFERENCE.key(team): (REFERENCE, OPERATOR),
            ESTOP.key(team): (ESTOP, ""),
            EVENT.key(team): (EVENT, SIM),
        }
        if config.estimator.kind == "truth":
            self.topics[TRUTH.key(team)] = (TRUTH, SIM)
        if central:
            self.topics[PLAN.key(team, robot)] = (PLAN, PLANNER)
        for peer in self._peers:
            self.topics[PLAN.key(team, peer)] = (PLAN, peer)
            self.topics[MEASUREMENT.key(team, peer)] = (MEASUREMENT, peer)
        self.counters: Counter[str] = Counter()
        self.heard: Counter[Source] = Counter()
        self.refused = self.ended = False
        self.misfits = 0
        self._newest: dict[Source, Order] = {}
        self._held: dict[str, list[tuple[str, Any]]] = {}  # sender and message by topic
        self._count: Counter[Source] = Counter()  # of these
        # In lock-step nobody asks for what peers measure while they stand until they walk.
        self._most = _HELD + config.gait.stand_ms // SAMPLE_MS
        self._step_ms = step_ms(config)
        self._now = -1  # tick of the newest state
        self._state: State | None = None
        self._estop: EStop | None = None

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
        message = read(topic, payload)
        if message is None or not _is_believable(message, self._robot):
            self.counters[f"dropped_{topic.name}"] += 1
            return
        if topic not in (ESTOP, EVENT) and self._ahead(message):
            self.counters[f"ahead_{topic.name}"] += 1
            self.misfits += topic is STATE
            self.refused |= topic is not STATE
            return
        self.heard[topic.name, sender] += 1
        self._keep(topic, sender, message)

    def _ahead(self, message: Message) -> bool:
        """Whether a message is of a time that nobody in the team can have come to.

        One such would be held for as long, and what is real would be late behind it. The first
        state is believed: it says what time it is.
        """
        if isinstance(message, State):
            return 0 <= self._now < message.tick - _JUMP_MS
        tick = message.step * self._step_ms if isinstance(message, Plan) else message.tick
        return tick > max(self._now, 0) + AHEAD_MS

    def _keep(self, topic: Topic, sender: str, message: Message) -> None:
        if isinstance(message, State):
            self._keep_newest(message)
        elif isinstance(message, EStop):
            self._estop = message
        elif isinstance(message, Event):
            self.ended = self.ended or message.kind == "stop"
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
        older = state.tick <= self._now
        if older or self._state is not None:
            self.counters["states_passed_over"] += 1
        if older:
            self.misfits += 1
        else:
            self._state, self._now, self.misfits = state, state.tick, 0

    def state(self) -> State | None:
        """The newest state, once; ticks only rise."""
        state, self._state = self._state, None
        return state

    def wanted(self, tick: int, awaited: Expected) -> list[Wanted]:
        """The last message of each source that the step of `tick` awaits."""
        wanted: list[tuple[Topic, str, Order | None]] = [
            *((PLAN, name, awaited.plan) for name in self._planners),
            *((MEASUREMENT, name, _tick(awaited.measurement_tick)) for name in self._peers),
            (REFERENCE, OPERATOR, _tick(awaited.reference_tick)),
            (TRUTH, SIM, _tick(tick if awaited.truth else None)),
        ]
        return [((topic.name, sender), due) for topic, sender, due in wanted if due is not None]

    def owing(self, tick: int, awaited: Expected) -> frozenset[Source]:
        """Whose message, of which topic, for the step of `tick` has not come yet."""
        return frozenset(
            source
            for source, due in self.wanted(tick, awaited)
            if self._newest.get(source, _NEVER) < due
        )

    def inputs(self, state: State, awaited: Expected) -> Inputs:
        """All that is due at the step of `state`, sorted by robot, then tick."""
        if self._lockstep and awaited is NOTHING and self._estop is None:
            return Inputs(state)
        plans = self._due(PLAN, awaited.plan)
        measurements = self._due(MEASUREMENT, _tick(awaited.measurement_tick))
        references = self._due(REFERENCE, _tick(awaited.reference_tick))
        truths = self._due(TRUTH, _tick(state.tick if awaited.truth else None))
        estop, self._estop = self._estop, None
        return Inputs(
            state,
            tuple(measurements),
            tuple(plans),
            tuple(ref for _, ref in references),
            estop,
            truths[-1][1] if truths else None,
        )

    def _due(self, topic: Topic, limit: Order | None) -> list[tuple[str, Any]]:
        """Take out the held messages of a topic up to `limit`."""
        if (self._lockstep and limit is None) or not (held := self._held.get(topic.name)):
            return []
        due: list[tuple[str, Any]] = []
        later: list[tuple[str, Any]] = []
        for item in held:
            on_time = not self._lockstep or limit is None or order_of(item[1]) <= limit
            (due if on_time else later).append(item)
        self._held[topic.name] = later
        self._count.subtract((topic.name, sender) for sender, _ in due)
        return sorted(due, key=lambda item: (item[0], order_of(item[1])))


def read(topic: Topic, payload: bytes) -> Message | None:
    """The message in a packet; None if it is none. Whatever comes as an emergency stop is one."""
    try:
        return decode(payload, topic.type)
    except MessageError:
        return EStop(0, 0, UNREADABLE) if topic is ESTOP else None


def _is_believable(message: Message, robot: str) -> bool:
    """Whether finite numbers can be meant, and for this robot.

    Orientations must be of unit length, references within limits, and the truth of this robot.
    """
    if isinstance(message, State):
        return is_orientation(message.imu_quat_wxyz)
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
