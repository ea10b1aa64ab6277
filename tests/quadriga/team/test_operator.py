"""What the operator asks for: nothing while the team stands, then a ramp."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from threading import Event as Flag
from threading import Thread
from typing import cast

import pytest
from rich.console import Console

from quadriga.drive.driver_words import WHERE
from quadriga.drive.find import open_link
from quadriga.shared.bus.session import HERE, READY, Bus, Packet
from quadriga.shared.codec import MAX_TEXT, MAX_TICK, decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import OPERATOR, SIM
from quadriga.shared.messages import Clock, EStop, Event, Message, Reference
from quadriga.shared.runtime.clock import sleep
from quadriga.shared.topics import CLOCK, ESTOP, EVENT, REFERENCE
from quadriga.team.drive_page import DrivePage
from quadriga.team.emergency_stop import stop_team
from quadriga.team.endpoint import free_endpoint
from quadriga.team.operator import TeamTicks, reference_at, run


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


def test_the_token_to_drive_with_is_in_no_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    config = load(None, {"bus.endpoint": free_endpoint(), "reference.driver": "hand"})
    tokens = list[str]()

    def stopped() -> bool:
        if not tokens:
            with open_link() as link:
                tokens.append(link.ask(WHERE)["url"].partition("?token=")[2])
            page = DrivePage(config, os.getpid(), Console(force_terminal=False))
            page.tell_once()
        return True

    run(config, stopped)
    said = capsys.readouterr()
    assert len(tokens[0]) > 16
    assert said.out.count("http://127.0.0.1:") == 2, "the operator's, and that of who started it"
    assert tokens[0] not in said.out + said.err


@pytest.mark.parametrize("late", [False, True])
def test_a_walk_ends_at_the_same_tick_for_who_is_behind(late: bool) -> None:
    """Else the last references of two equal walks would depend on who was faster."""
    config = load(None, {"bus.endpoint": free_endpoint()})
    sim, operator = (Bus.open(config.bus, "team", name) for name in (SIM, OPERATOR))
    with sim, operator:
        for key in (CLOCK.key("team"), EVENT.key("team")):
            operator.subscribe(key)
        operator.declare(HERE)
        assert sim.wait_for(HERE, {OPERATOR}, 10.0, lambda: False)
        sim.declare(HERE)
        assert operator.wait_for(HERE, {SIM}, 10.0, lambda: False)
        clock, event = sim.publisher(CLOCK.key("team")), sim.publisher(EVENT.key("team"))
        time = TeamTicks(operator, 20_000)
        for tick in range(0, 800, 10):
            clock(encode(Clock(tick, tick * 10**6)))
            while not late and time.tick < tick:
                time.follow()
                assert not time.over
        event(encode(Event(800, 800 * 10**6, "stop", "", "end of world.duration", "time-over")))
        if late:
            sim.close()  # it leaves once all has arrived
        while not time.over:
            time.follow()
        assert time.tick == 799


class Said:
    """A bus that brings these packets, and then nothing; nobody is there."""

    team = "team"

    def __init__(self, *messages: Message) -> None:
        keys = {Clock: CLOCK.key("team"), Event: EVENT.key("team")}
        self._packets = [(keys[type(message)], encode(message)) for message in messages]

    def get(self, timeout: float) -> Packet | None:
        return self._packets.pop(0) if self._packets else None

    def drain(self) -> list[Packet]:
        packets, self._packets = self._packets, []
        return packets

    def members_at(self, stage: str) -> frozenset[str]:
        return frozenset({SIM})


def followed(*messages: Message) -> TeamTicks:
    """The team's time after these, of a walk of 8 s."""
    time = TeamTicks(cast("Bus", Said(*messages)), 8000)
    time.follow()
    return time


def stop_at(tick: int) -> Event:
    return Event(tick, 10**6 * tick, "stop", "", "", "signal")


@pytest.mark.parametrize("tick", [8001, 1 << 41])
def test_a_time_that_the_team_cannot_have_come_to_is_not_followed(tick: int) -> None:
    time = followed(Clock(0, 0), Clock(tick, 0), Clock(10, 0), stop_at(tick + 10), Clock(20, 0))
    assert (time.tick, time.over) == (20, False)
    time = followed(Clock(1 << 41, 0), Clock((1 << 41) + 10, 0))
    assert time.tick == 0, "however often it is said"


def test_an_end_that_time_goes_on_after_was_none() -> None:
    time = followed(Clock(0, 0), stop_at(100), Clock(90, 0), Clock(100, 0))
    assert (time.tick, time.over) == (99, True)
    time = followed(Clock(0, 0), stop_at(100), Clock(110, 0))
    assert (time.tick, time.over) == (110, False)
    time = followed(Clock(0, 0), stop_at(100), Clock(110, 0), stop_at(120))
    assert (time.tick, time.over) == (119, True)


def test_an_operator_who_missed_something_catches_up() -> None:
    time = followed(Clock(0, 0), Clock(4000, 0), Clock(4010, 0), stop_at(4200))
    assert (time.tick, time.over) == (4199, True)


@pytest.mark.parametrize("forged", [Clock(1 << 41, 0), stop_at(1 << 41)])
def test_an_operator_whom_forged_times_reach_leaves_when_it_is_told_to(forged: Message) -> None:
    config = load(
        None,
        {"team.robots": 1, "planner.kind": "none", "recorder.enabled": False}
        | {"bus.endpoint": free_endpoint(), "world.duration": 8.0, "runtime.priority": "ordinary"},
    )
    told = Flag()
    thread = Thread(target=run, args=(config, told.is_set))
    with Bus.open(config.bus, "team", SIM) as sim, Bus.open(config.bus, "team", "r1") as r1:
        sim.subscribe(REFERENCE.key("team"))
        sim.declare(HERE)
        r1.declare(HERE)
        thread.start()
        try:
            assert sim.wait_for(READY, {OPERATOR}, 10.0, lambda: False)
            topic = CLOCK if isinstance(forged, Clock) else EVENT
            clock, put = sim.publisher(CLOCK.key("team")), sim.publisher(topic.key("team"))
            put(encode(forged))
            clock(encode(Clock(0, 0)))
            clock(encode(Clock(100, 0)))
            ticks = []
            while 500 not in ticks:  # 400 ms ahead of the clock
                packet = sim.get(10.0)
                assert packet is not None
                ticks.append(decode(packet[1], Reference).tick)
        finally:
            told.set()
            thread.join(10.0)
    assert not thread.is_alive()
    assert ticks == [*range(0, 501, 100)], "no reference that nobody is waiting for"


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

        def stop() -> None:
            with suppress(BusError):  # nobody here says that it has stopped
                stop_team(config, reason, print)

        threads = [Thread(target=tell), Thread(target=stop)]
        for thread in threads:
            thread.start()
        try:
            sleep(1.0)  # the tick is heard before anybody is there to stop
            r1.declare(HERE)
            sim.declare(HERE)
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
