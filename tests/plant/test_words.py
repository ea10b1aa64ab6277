"""What people have said to a plant, over a bus of its own."""

from __future__ import annotations

import pytest

from quadriga.plant.words import NO_WORDS, Words, listen_to_words
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
        (ESTOP, [EStop(1, 0, "dog"), EStop(2, 0, "cat")], Words("dog")),
        (ESTOP, [EStop(1, 0, "")], Words("estop")),
        (ESTOP, [b"stop!"], Words("unreadable")),
        (RESET, [FIRST, LAST, b"no"], Words(reset=LAST)),
        (STOP, [LUNCH], Words(stop=LUNCH)),
        (LIVE_FAULT, [GONE, b"no", STUCK], Words(faults=(GONE.fault, STUCK.fault))),
    ],
)
def test_an_unreadable_stop_is_one_and_nothing_else_that_is_unreadable(
    topic: Topic, payloads: list[Message | bytes], heard: Words
) -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with Bus.open(config.bus, "team", SIM) as sim, Bus.open(config.bus, "team", "who") as who:
        words, put = listen_to_words(sim), who.publisher(topic.key("team"))
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
        assert words() == heard
        assert words() == NO_WORDS
