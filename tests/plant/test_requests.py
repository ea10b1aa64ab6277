"""What people have asked of a plant since it was called last."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from quadriga.plant.requests import NO_REQUESTS, Requests, subscribe_requests
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import encode
from quadriga.shared.messages import EStop, LiveFault, Message, Reset, SafeStop
from quadriga.shared.topics import ESTOP, LIVE_FAULT, RESET, STOP, Topic

FIRST, LAST = Reset(1, 0, "ann"), Reset(2, 0, "bob")
GONE, STUCK = LiveFault(1, 0, "r1/imu off"), LiveFault(2, 0, "r2/FL_calf stuck")
LUNCH = SafeStop(1, 0, "lunch", True)


@pytest.mark.parametrize(
    ("topic", "payloads", "heard"),
    [
        (ESTOP, [EStop(1, 0, "dog"), EStop(2, 0, "cat")], Requests("dog")),
        (ESTOP, [EStop(1, 0, "")], Requests("estop")),
        (ESTOP, [b"stop!"], Requests("unreadable")),
        (RESET, [FIRST, LAST, b"no"], Requests(reset=LAST)),
        (STOP, [LUNCH], Requests(stop=LUNCH)),
        (LIVE_FAULT, [GONE, b"no", STUCK], Requests(faults=(GONE.fault, STUCK.fault))),
    ],
)
def test_an_unreadable_stop_is_one_and_nothing_else_that_is_unreadable(
    topic: Topic, payloads: list[Message | bytes], heard: Requests
) -> None:
    arrived: list[Any] = []

    def collect(*keys: str) -> Any:
        assert topic.key("team") in keys
        return lambda: [arrived.pop(0) for _ in range(len(arrived))]

    requests = subscribe_requests(cast("Bus", SimpleNamespace(team="team", collect=collect)))
    for each in payloads:
        arrived.append((0, topic.key("team"), each if isinstance(each, bytes) else encode(each)))
    assert requests() == heard
    assert requests() is NO_REQUESTS
