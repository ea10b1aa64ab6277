"""What people have asked of a plant, over a bus of its own."""

from __future__ import annotations

import pytest

from quadriga.plant.requests import NO_REQUESTS, Requests, subscribe_requests
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.members import SIM
from quadriga.shared.messages import EStop, LiveFault, Message, Reset, SafeStop
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import ESTOP, LIVE_FAULT, RESET, STOP, Topic
from quadriga.team.endpoint import free_endpoint

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
    config = load(None, {"bus.endpoint": free_endpoint()})
    with Bus.open(config.bus, "team", SIM) as sim, Bus.open(config.bus, "team", "who") as who:
        requests, put = subscribe_requests(sim), who.publisher(topic.key("team"))
        seen = sim.collect(topic.key("team"))
        sim.declare(HERE)
        assert who.wait_for(HERE, {SIM}, 10.0, lambda: False)
        for payload in payloads:
            put(payload if isinstance(payload, bytes) else encode(payload))
        count, deadline = 0, monotonic() + 10.0
        while count < len(payloads):
            assert monotonic() < deadline
            count += len(seen())
            sleep(0.001)
        assert requests() == heard
        assert requests() == NO_REQUESTS
