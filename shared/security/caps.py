"""How much a router lets through: bytes and rates by key, sessions, sizes; Zenoh's settings.

A message that is larger or comes sooner than permitted is dropped before anybody decodes it. A
rate has no burst in Zenoh: it is the least time between two messages, and the newer one is dropped.
What a slow link or a busy processor has held up comes at once: at 10,000 in a second up to one in
300 of a team's own messages was dropped in real time. So only messages of every tick have a rate,
no less than that at which a router passes messages on. All others are limited by their size, a stop
by nothing else.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from math import prod
from typing import Any, Final

from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.security.roll import team_roll
from quadriga.shared.wire.about import QUESTIONS
from quadriga.shared.wire.codec import MAX_BYTES, MAX_TEXT
from quadriga.shared.wire.messages import Message
from quadriga.shared.wire.topic import Topic
from quadriga.shared.wire.topics import RECEIVED, TABLE

_MARGIN: Final = 200  # times the messages of real time
_SPARE_SESSIONS: Final = 8  # for those who look on, and who has yet to be found dead
# Greatest length of what has no fixed one, by its letter: samples, robots, yokes, plans, ticks.
_LENGTHS: Final = {"N": 100, "n": 10, "k": 45, "P": 1000, "K": 10_000}
_LISTED: Final = 16_384  # bytes of a list or a map
_TEXT: Final = 4 * MAX_TEXT  # bytes
_NUMBER: Final = 9  # bytes
_FRAME: Final = 32  # bytes beside the content of a field, its name aside
_ANSWER: Final = 256  # bytes of a question whether all has arrived, and of the answer


def largest(kind: type[Message]) -> int:
    """Bytes that a message of a type takes at most."""
    sizes = {bool: 1, int: _NUMBER, float: _NUMBER, str: _TEXT, list: _LISTED, dict: _LISTED}
    total = _FRAME
    for item in fields(kind):
        meta = item.metadata
        size = _array(meta["shape"]) if "shape" in meta else sizes[meta["kind"]]
        total += len(item.name) + _FRAME + size
    return min(total, MAX_BYTES)


def greatest_rate(topic: Topic) -> float:
    """Messages of one key in a second above which they are dropped; 0: no limit."""
    return _MARGIN * 1000.0 if topic.period_ms == 1 else 0.0


def capacity(config: Config) -> dict[str, Any]:
    """Zenoh's settings of a router that let nobody take more than its share."""
    team, robots = config.team.name, robot_names(config.team.robots)
    return {
        "low_pass_filter": list(_sizes(team)),
        "downsampling": [
            {
                "id": "rates",
                "flows": ["ingress"],
                "messages": ["put"],
                "rules": [{"key_expr": key, "freq": rate} for key, rate in _rates(team, robots)],
            }
        ],
        "transport/unicast/max_sessions": len(team_roll(config)) + _SPARE_SESSIONS,
        "transport/unicast/max_links": 1,  # the rules do not see a second link of a session
        "transport/link/rx/max_message_size": MAX_BYTES,
    }


def _sizes(team: str) -> Iterable[dict[str, Any]]:
    for topic in TABLE:
        yield _size(topic.name, ["put"], topic.key(team, "*"), largest(topic.type))
    yield _size("receipts", ["query", "reply"], f"{team}/*/{RECEIVED}", _ANSWER)
    for question in QUESTIONS:
        limit = largest(question.type)
        yield _size(question.name, ["query", "reply"], question.key(team, "*"), limit)


def _size(name: str, messages: list[str], key: str, limit: int) -> dict[str, Any]:
    flows = ["ingress"]
    return {
        "id": name,
        "messages": messages,
        "flows": flows,
        "key_exprs": [key],
        "size_limit": limit,
    }


def _rates(team: str, robots: Iterable[str]) -> Iterable[tuple[str, float]]:
    """Rates by key, one by one: Zenoh keeps one time for each rule, not for each key."""
    for topic in TABLE:
        rate = greatest_rate(topic)
        if rate:
            for name in robots if topic.per_robot else ("",):
                yield topic.key(team, name), rate


def _array(shape: Iterable[int | str]) -> int:
    """Bytes of float64 of a shape; of a length that nobody knows as many as a message may have."""
    return 8 * prod(d if isinstance(d, int) else _LENGTHS.get(d, MAX_BYTES) for d in shape)
