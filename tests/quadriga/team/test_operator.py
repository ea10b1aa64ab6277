"""What the operator asks for: nothing while the team stands, then a ramp."""

from __future__ import annotations

from pathlib import Path
from threading import Event as Flag
from threading import Thread

import pytest

from quadriga.shared.bus.zenoh_bus import HERE, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import BusConfig, Config
from quadriga.shared.members import OPERATOR, SIM
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.wire.codec import MAX_TEXT, MAX_TICK, decode, encode
from quadriga.shared.wire.messages import Clock, EStop, Event
from quadriga.shared.wire.topics import CLOCK, ESTOP, EVENT
from quadriga.team.endpoint import free_endpoint
from quadriga.team.operator import _next_tick, reference_at, stop_team


def test_stand_then_ramp_then_full_speed() -> None:
    config = load(None, {"reference.vx": 0.4, "reference.wz": -0.2, "reference.ramp": 2.0})
    speeds = [reference_at(config, tick).vx for tick in (0, 300, 800, 1300, 2300, 9000)]
    assert speeds == pytest.approx([0.0, 0.0, 0.1, 0.2, 0.4, 0.4])
    assert reference_at(config, 1300).wz == pytest.approx(-0.1)
    assert reference_at(config, 1300).tick == 1300
    assert reference_at(config, 1300).stamp_ns == 1_300_000_000


def test_without_a_ramp_full_speed_starts_with_the_first_step() -> None:
    config = load(None, {"reference.ramp": 0.0})
    assert [reference_at(config, tick).vx for tick in (0, 299, 300)] == [0.0, 0.0, 0.5]


def test_height_is_asked_for_from_the_start() -> None:
    assert reference_at(Config(), 0).height == Config().reference.height


def test_a_trace_is_followed_from_the_first_step_on(tmp_path: Path) -> None:
    path = tmp_path / "trace.csv"
    path.write_text("t,vx,vy,wz\n0,0,0,0\n2,0.4,0.2,-0.2\n4,0,0,0\n", encoding="utf-8")
    config = load(None, {"reference.trace": str(path), "reference.ramp": 1.0})
    asked = [reference_at(config, tick) for tick in (0, 300, 800, 2300, 4300, 6300)]
    assert [r.vx for r in asked] == pytest.approx([0.0, 0.0, 0.05, 0.4, 0.0, 0.4])
    assert (asked[3].vy, asked[3].wz) == pytest.approx((0.2, -0.2))
    assert asked[3].height == Config().reference.height


@pytest.mark.parametrize("late", [False, True])
def test_a_walk_ends_at_the_same_tick_for_who_is_behind(late: bool) -> None:
    """Else the last references of two equal walks would depend on who was faster."""
    config = BusConfig(endpoint=free_endpoint())
    with Bus.open(config, "team", SIM) as sim, Bus.open(config, "team", OPERATOR) as operator:
        for key in (CLOCK.key("team"), EVENT.key("team")):
            operator.subscribe(key)
        operator.declare(HERE)
        assert sim.wait_for(HERE, {OPERATOR}, 10.0, lambda: False)
        sim.declare(HERE)
        assert operator.wait_for(HERE, {SIM}, 10.0, lambda: False)
        clock, event = sim.publisher(CLOCK.key("team")), sim.publisher(EVENT.key("team"))
        newest = 0
        for tick in range(0, 800, 10):
            clock(encode(Clock(tick, tick * 10**6)))
            while not late and newest < tick:
                newest, over = _next_tick(operator, newest)
                assert not over
        event(encode(Event(800, 800 * 10**6, "stop", "", "end of world.seconds", "time-over")))
        if late:
            sim.close()  # it leaves once all has arrived
        over = False
        while not over:
            newest, over = _next_tick(operator, newest)
        assert newest == 799


def said_stop(reason: str, tick: int) -> EStop:
    """What a robot hears of an emergency stop while somebody tells a tick on the clock's key."""
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    with Bus.open(config.bus, "team", SIM) as sim, Bus.open(config.bus, "team", "r1") as r1:
        r1.subscribe(ESTOP.key("team"))
        put, over = sim.publisher(CLOCK.key("team")), Flag()
        event = encode(Event(tick, 0, "", "", "", ""))

        def tell() -> None:
            while not over.wait(0.02):
                put(event)

        threads = [Thread(target=tell), Thread(target=stop_team, args=(config, reason))]
        for thread in threads:
            thread.start()
        try:
            sleep(1.0)  # the tick is heard before anybody is there to stop
            r1.declare(HERE)
            packet = r1.get(10.0)
        finally:
            over.set()
            for thread in threads:
                thread.join()
    assert packet is not None
    return decode(packet[1], EStop)


@pytest.mark.parametrize(
    ("typed", "sent"),
    [
        ("smoke", "smoke"),
        ("St\udcfcrz", "St?rz"),  # typed in a Latin-1 terminal
        ("x" * (MAX_TEXT + 1), "x" * 199 + "…"),
    ],
)
def test_every_agent_can_read_an_emergency_stop(typed: str, sent: str) -> None:
    assert said_stop(typed, 700).reason == sent


def test_a_tick_that_no_agent_accepts_is_not_passed_on() -> None:
    assert said_stop("smoke", 700).tick == 700
    assert said_stop("smoke", MAX_TICK).tick == 0
