"""One row of the table of topics, and the rows that other packages bring.

Those are entry points of the group `quadriga.topics`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from importlib.metadata import entry_points
from typing import Any, Final

from quadriga.shared.errors import ConfigError
from quadriga.shared.members import ESTOP, LAUNCHER, ROLES
from quadriga.shared.messages import Message

CONFIGURED: Final = -1  # a time that the configuration says: see `quadriga.shared.config.timing`
_NAME: Final = re.compile(r"[A-Za-z0-9_.-]+(/[A-Za-z0-9_.-]+)*")
_TAKERS: Final = frozenset({LAUNCHER, ESTOP, *(role.name for role in ROLES)})


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


def plugin_topics(own: Sequence[Topic]) -> tuple[Topic, ...]:
    """The rows of all installed packages, by the names of their entry points.

    They are recorded, listed, exported and documented like the project's own; but no process of
    the project acts on their messages.

    Args:
        own: the project's rows.

    Raises:
        ConfigError: an entry point cannot be imported or is no row, or its row is like another.
    """
    rows = list(own)
    entries = entry_points(group="quadriga.topics")
    for entry in sorted(entries, key=lambda entry: (entry.name, entry.value)):
        dist = f" of {entry.dist.name} {entry.dist.version}" if entry.dist else ""
        name = f"entry point {entry.name} = {entry.value} in quadriga.topics{dist}"
        try:
            row = entry.load()
        except Exception as error:
            got = f"{type(error).__name__}: {error}"
            cause = "its module may import quadriga.shared.topic and .messages, and nothing else"
            raise ConfigError(name, got, "a row that can be imported", cause) from error
        if wrong := _objection(row, rows):
            raise ConfigError(name, *wrong)
        rows.append(row)
    return tuple(rows[len(own) :])


def _objection(row: Any, rows: Sequence[Topic]) -> tuple[str, str] | None:
    """What is wrong with a row beside those before it: got, expected; None: nothing."""
    if not isinstance(row, Topic):
        return repr(row)[:80], "a Topic of quadriga.shared.topic"
    if not (isinstance(row.type, type) and issubclass(row.type, Message)):
        return repr(row.type)[:80], "a Message of quadriga.shared.messages"
    if not _NAME.fullmatch(row.name) or row.name in {other.name for other in rows}:
        return repr(row.name), "a name of its own, such as 'wind' or 'weather/wind'"
    if row.type.__name__ in {other.type.__name__ for other in rows}:
        return row.type.__name__, "a message type with a name of its own: schemas have it"
    if row.period_ms < 0 or row.max_age_ms < 0:
        return f"period_ms {row.period_ms}, max_age_ms {row.max_age_ms}", "at least 0"
    if taken := sorted(_TAKERS & {*row.receivers}):
        return ", ".join(taken), "receivers of its own: these take only what they know"
    return None
