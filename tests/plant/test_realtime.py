"""In real time a plant keeps its own milliseconds and follows the team's clock when they drift."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from quadriga.plant.realtime import TICK, _keep_time
from quadriga.plant.server import PlantServer
from quadriga.plant.team_time import FollowerTime
from quadriga.shared.config.load import load
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import Clock
from quadriga.shared.wire.topics import CLOCK
from tests.manual_clock import ManualClock


@pytest.mark.parametrize("drift", [0, 3, -3, 40, -40])
def test_a_follower_waits_or_hurries_until_it_is_with_the_clock(drift: int) -> None:
    """It is held back at once, makes up for two ticks with every clock, and lets 3 ms pass."""
    config = load(None, {"team.robots": 2, "team.yokes": "none", "team.plants": "each"})
    time, wall = FollowerTime(config), ManualClock()
    rate = Rate(TICK, wall.monotonic, wall.sleep, slack=3.0)
    bus = SimpleNamespace(members_at=lambda _stage: {"plant_r1"})
    plant = SimpleNamespace(tick=100 + drift)
    server = cast(PlantServer, SimpleNamespace(time=time, bus=bus, plant=plant))
    sent, longest = 0, 0.0
    while wall.now < 0.5:
        before, lead = wall.now, 100 + round(wall.now / TICK)
        rate.wait()
        longest = max(longest, wall.now - before)
        if lead // 10 > sent // 10:
            sent = lead - lead % 10
            time.take(CLOCK.key("team"), encode(Clock(sent, 0)), plant.tick)
        _keep_time(server, rate)
        plant.tick += 1
        assert time.end is None
    after = plant.tick - 100 - round(wall.now / TICK)
    assert after == drift or (abs(drift) > 3 and abs(after) <= 3)
    assert longest == pytest.approx(TICK * (drift + 1 if drift > 3 else 1), abs=TICK)
