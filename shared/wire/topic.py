"""One row of the table of topics."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Final

from quadriga.shared.wire.messages import Message

CONFIGURED: Final = -1  # a time that the configuration says: see `quadriga.shared.config.timing`


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
    type: type[Message]
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
