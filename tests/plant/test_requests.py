"""What people have asked of a plant since it was called last."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from quadriga.plant.requests import find_estop, subscribe_requests
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import encode
from quadriga.shared.messages import EStop, LiveFault, Message, Reset, SafeStop
from quadriga.shared.topics import ESTOP, LIVE_FAULT, RESET, STOP, Topic

FIRST, LAST = Reset(1, 0, "ann"), Reset(2, 0, "bob")
GONE, LUNCH = LiveFault(1, 0, "r1/imu off"), SafeStop(1, 0, "lunch", True)
DOG, CAT, NAMELESS = (EStop(k, 0, reason) for k, reason in enumerate(("dog", "cat", "")))


@pytest.mark.parametrize(
    ("topic", "payloads", "heard", "estop"),
    [
        (ESTOP, [DOG, CAT], [DOG, CAT], "dog"),
        (ESTOP, [NAMELESS], [NAMELESS], "estop"),
        (ESTOP, [b"stop!"], [EStop(0, 0, "unreadable")], "unreadable"),
        (RESET, [FIRST, LAST, b"no"], [FIRST, LAST], ""),
        (STOP, [LUNCH], [LUNCH], ""),
        (LIVE_FAULT, [b"no", GONE], [GONE], ""),
    ],
)
def test_an_unreadable_stop_is_one_and_nothing_else_that_is_unreadable(
    topic: Topic, payloads: list[Message | bytes], heard: list[Message], estop: str
) -> None:
    arrived: list[Any] = []

    def collect(*keys: str) -> Any:
        assert topic.key("team") in keys
        return lambda: [arrived.pop(0) for _ in range(len(arrived))]

    requests = subscribe_requests(cast("Bus", SimpleNamespace(team="team", collect=collect)))
    for each in payloads:
        arrived.append((0, topic.key("team"), each if isinstance(each, bytes) else encode(each)))
    said = requests()
    assert (said, find_estop(said)) == (heard, estop)
    assert requests() == []
