"""Which commands were never sent, as their agents say in real time."""

from __future__ import annotations

import pytest

from quadriga.shared.config.load import load
from quadriga.shared.recording.passed_over import PassedOver
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import Consumed


def consumed(passed: int) -> bytes:
    return encode(Consumed(53, 0, 0, passed, (), ()))


def test_an_agent_says_how_many_ticks_it_passed_over() -> None:
    found = PassedOver(load(None, {"team.robots": 2, "world.mode": "realtime"}))
    assert found.find("team/r2/inputs", consumed(3)) == ("team/r2/command", 3)


@pytest.mark.parametrize(
    ("mode", "key", "payload"),
    [
        ("realtime", "team/r2/inputs", consumed(0)),
        ("realtime", "team/r2/inputs", b"\xc1"),
        ("realtime", "team/r3/inputs", consumed(3)),
        ("realtime", "team/r2/status", consumed(3)),
        ("lockstep", "team/r2/inputs", consumed(3)),
    ],
)
def test_all_else_says_nothing_about_it(mode: str, key: str, payload: bytes) -> None:
    found = PassedOver(load(None, {"team.robots": 2, "world.mode": mode}))
    assert found.find(key, payload) is None
