"""The table of topics: key, message type, period, maximum age, who sends it and who takes it."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Final

from quadriga.shared import members
from quadriga.shared import messages as msg
from quadriga.shared.errors import MessageError
from quadriga.shared.members import AGENT, LAUNCHER, OPERATOR, PLANNER, SIM, SPEAKERS

CONFIGURED: Final = -1  # a time that the configuration says: see `quadriga.shared.config.timing`
SAMPLE_MS: Final = 10  # one sample of u and y: forces are means over it, outputs taken at its end
REFERENCE_EPOCH_MS: Final = 100  # the operator speaks at multiples of this
CLOCK_MS: Final = 50  # so often the plant that drives it tells the time
TICKS_MS: Final = 10  # so much of what goes over a plant link is told at once
STATUS_MS: Final = 100  # so often an agent gives account of itself in lock-step
RECEIVED: Final = "received"  # ends the key of the question whether all before it has arrived

_PLANS: Final = (AGENT, PLANNER)  # who plans


@dataclass(frozen=True, slots=True)
class Topic:
    """One row of the table.

    Attributes:
        name: last part of the key; `per_robot` tells whether a robot's name stands before it.
        type: the message's dataclass.
        senders: roles whose processes publish it.
        receivers: roles whose processes act on it, the recorder aside.
        per_robot: whether every robot has one of its own.
        period_ms: world time between two of them; 0: sent on event; or `CONFIGURED`.
        max_age_ms: longest gap between two of them, in world time, that is nothing unusual; of a
            reference also how long it is obeyed. 0: none; or `CONFIGURED`.
        recorded: whether it is part of a recording of everything.
        repeats: whether several may be of one tick.
    """

    name: str
    type: type[msg.Message]
    senders: tuple[str, ...]
    receivers: tuple[str, ...]
    _: KW_ONLY
    per_robot: bool = False
    period_ms: int
    max_age_ms: int = 0
    recorded: bool = True
    repeats: bool = False

    def key(self, team: str, robot: str = "") -> str:
        """The Zenoh key of this topic; `robot` may be `*`."""
        return f"{team}/{robot}/{self.name}" if self.per_robot else f"{team}/{self.name}"

    def link_key(self, team: str, robot: str) -> str:
        """Where packets of a plant link go over the bus; no `**` of who looks on takes it in."""
        return f"{team}/@link/{robot}/{self.name}"


STATE: Final = Topic(
    "state", msg.State, (SIM,), (AGENT,), per_robot=True, period_ms=1, max_age_ms=20
)
COMMAND: Final = Topic(
    "command", msg.Command, (AGENT,), (SIM,), per_robot=True, period_ms=1, max_age_ms=20
)
MEASUREMENT: Final = Topic(
    "measurement", msg.Measurement, (AGENT,), _PLANS,
    per_robot=True, period_ms=SAMPLE_MS, max_age_ms=200,
)  # fmt: skip
PLAN: Final = Topic(
    "plan", msg.Plan, _PLANS, (AGENT,),
    per_robot=True, period_ms=CONFIGURED, max_age_ms=CONFIGURED,
)  # fmt: skip
STATUS: Final = Topic(
    "status", msg.Status, (*_PLANS, SIM), (AGENT, OPERATOR, LAUNCHER, *SPEAKERS),
    per_robot=True, period_ms=CONFIGURED, max_age_ms=1000, repeats=True,
)  # fmt: skip
INPUTS: Final = Topic("inputs", msg.Consumed, (AGENT,), (), per_robot=True, period_ms=0)
REFERENCE: Final = Topic(
    "reference", msg.Reference, (OPERATOR,), _PLANS,
    period_ms=REFERENCE_EPOCH_MS, max_age_ms=500, repeats=True,
)  # fmt: skip
ESTOP: Final = Topic("estop", msg.EStop, (members.ESTOP,), (AGENT, SIM), period_ms=0)
STOP: Final = Topic(
    "stop", msg.SafeStop, (OPERATOR, members.STOP), (AGENT, SIM), period_ms=0, repeats=True
)
RESET: Final = Topic(
    "reset", msg.Reset, (OPERATOR, members.RESET), (AGENT, SIM), period_ms=0, repeats=True
)
RESUME: Final = Topic(
    "resume", msg.Resume, (OPERATOR, members.RESET, members.RESUME), (AGENT,),
    period_ms=0, repeats=True,
)  # fmt: skip
REQUESTS: Final = (ESTOP, STOP, RESET, RESUME)  # of people, who may not know the team's time
LIVE_FAULT: Final = Topic("fault", msg.LiveFault, (LAUNCHER,), (SIM,), period_ms=0, repeats=True)
TRUTH: Final = Topic("sim/truth", msg.Truth, (SIM,), (AGENT, LAUNCHER), period_ms=CONFIGURED)
EVENT: Final = Topic(
    "sim/event", msg.Event, (SIM,), (*_PLANS, OPERATOR, LAUNCHER, *SPEAKERS, SIM),
    period_ms=0, repeats=True,
)  # fmt: skip
# What an agent tells of itself beside its status; never of the kind `stop`, which ends a walk.
AGENT_EVENT: Final = Topic(
    "event", msg.Event, (AGENT,), (LAUNCHER,), per_robot=True, period_ms=0, repeats=True
)
# What `quadriga fault` does to processes, links and clocks, told by who does it. What is done to
# sensors and motors the world tells.
INJECTED: Final = Topic("injected", msg.Event, (LAUNCHER,), (), period_ms=0, repeats=True)
# Not recorded: the states of every tick tell the same.
CLOCK: Final = Topic(
    "clock", msg.Clock, (SIM,), (OPERATOR, LAUNCHER, *SPEAKERS, SIM),
    period_ms=CLOCK_MS, recorded=False,
)  # fmt: skip
# What went over the plant links, by plants, and by agents whose plant is gone. Not recorded: each
# state and command in it is, under a key of its own.
TICKS: Final = Topic(
    "ticks", msg.Ticks, (SIM, AGENT), (SIM,), per_robot=True, period_ms=TICKS_MS, recorded=False,
    repeats=True,
)  # fmt: skip

TABLE: Final = (
    STATE, COMMAND, MEASUREMENT, PLAN, STATUS, INPUTS, REFERENCE, *REQUESTS, LIVE_FAULT, TRUTH,
    EVENT, AGENT_EVENT, INJECTED, CLOCK, TICKS,
)  # fmt: skip
_BY_NAME: Final = {topic.name: topic for topic in TABLE}


def topics_for(role: str) -> tuple[Topic, ...]:
    """What the processes of a role receive, in the order of the table."""
    return tuple(topic for topic in TABLE if role in topic.receivers)


def topic_of(key: str) -> tuple[Topic, str]:
    """The table row and the robot's name (or "") that a key stands for.

    Raises:
        MessageError: no row has this key.
    """
    topic, robot = find_topic(key)
    if topic is None:
        raise MessageError("key", repr(key), "a key of the table of topics", "a foreign publisher?")
    return topic, robot


def find_topic(key: str) -> tuple[Topic | None, str]:
    """As `topic_of`, but None and "" if no row has this key."""
    _, _, rest = key.partition("/")
    if rest in _BY_NAME and not _BY_NAME[rest].per_robot:
        return _BY_NAME[rest], ""
    robot, _, name = rest.partition("/")
    if name in _BY_NAME and _BY_NAME[name].per_robot:
        return _BY_NAME[name], robot
    return None, ""
