"""The table of topics: key, message type, rate, maximum age."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from quadriga.shared.errors import MessageError
from quadriga.shared.wire import messages as msg


@dataclass(frozen=True, slots=True)
class Topic:
    """One row of the table.

    Attributes:
        name: last part of the key; `per_robot` tells whether a robot's name stands before it.
        type: the message's dataclass.
        rate_hz: nominal rate; 0 means on event.
        max_age_ms: longest gap between two of them, in world time, that is nothing unusual; of a
            reference also how long it is obeyed. 0: none, or the configuration says it:
            `quadriga.shared.recording.sequence.max_ages`.
    """

    name: str
    type: type[msg.Message]
    per_robot: bool
    rate_hz: float
    max_age_ms: int

    def key(self, team: str, robot: str = "") -> str:
        """The Zenoh key of this topic; `robot` may be `*`."""
        return f"{team}/{robot}/{self.name}" if self.per_robot else f"{team}/{self.name}"


SAMPLE_MS: Final = 10  # one sample of u and y: forces are means over it, outputs taken at its end
REFERENCE_EPOCH_MS: Final = 100  # the operator speaks at multiples of this

STATE: Final = Topic("state", msg.State, True, 1000.0, 20)
COMMAND: Final = Topic("command", msg.Command, True, 1000.0, 20)
MEASUREMENT: Final = Topic("measurement", msg.Measurement, True, 1000.0 / SAMPLE_MS, 200)
PLAN: Final = Topic("plan", msg.Plan, True, 25.0, 0)
STATUS: Final = Topic("status", msg.Status, True, 10.0, 1000)
INPUTS: Final = Topic("inputs", msg.Consumed, True, 0.0, 0)
REFERENCE: Final = Topic("reference", msg.Reference, False, 1000.0 / REFERENCE_EPOCH_MS, 500)
ESTOP: Final = Topic("estop", msg.EStop, False, 0.0, 0)
TRUTH: Final = Topic("sim/truth", msg.Truth, False, 1000.0 / SAMPLE_MS, 0)
EVENT: Final = Topic("sim/event", msg.Event, False, 0.0, 0)

TABLE: Final = (
    STATE, COMMAND, MEASUREMENT, PLAN, STATUS, INPUTS, REFERENCE, ESTOP, TRUTH, EVENT,
)  # fmt: skip
_BY_NAME: Final = {topic.name: topic for topic in TABLE}


def topic_of(key: str) -> tuple[Topic, str]:
    """The table row and the robot's name (or "") that a key stands for.

    Raises:
        MessageError: no row has this key.
    """
    _, _, rest = key.partition("/")
    if rest in _BY_NAME and not _BY_NAME[rest].per_robot:
        return _BY_NAME[rest], ""
    robot, _, name = rest.partition("/")
    if name in _BY_NAME and _BY_NAME[name].per_robot:
        return _BY_NAME[name], robot
    raise MessageError("key", repr(key), "a key of the table of topics", "a foreign publisher?")
