"""Plants begin each tick by their system clocks, from one T0, or refuse to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from threading import Event, Thread
from types import SimpleNamespace
from typing import cast

import pytest

from quadriga.plant import loops as module
from quadriga.plant.loops import TeamPace
from quadriga.shared.bus.diagnostics import MemberAnswer, members
from quadriga.shared.bus.discovery import ProcessInfo, join
from quadriga.shared.bus.session import READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import monotonic_ns, sleep
from quadriga.team.endpoint import free_endpoint
from tests.shared.bus.abouts import SIM, answer

MS, S = 1_000_000, 1_000_000_000


def never() -> bool:
    return False


def pause() -> None:
    sleep(0.002)


@pytest.fixture
def config() -> Config:
    keys = {
        "team.robots": 2,
        "team.yokes": "none",
        "team.plant_per_robot": True,
        "world.mode": "realtime",
        "planner.kind": "none",
        "recorder.enabled": False,
        "bus.endpoint": free_endpoint(),
        "bus.barrier_timeout": 10.0,
    }
    return load(None, keys)


@pytest.fixture
def paces(config: Config) -> Iterator[dict[str, TeamPace]]:
    """Of both plants of a team whose processes have all met."""
    with ExitStack() as stack:
        names = sorted(members(config), key=lambda name: name != "plant_r1")
        buses = {n: stack.enter_context(Bus.open(config.bus, "team", n)) for n in names}
        said = {name: ProcessInfo(bus, config) for name, bus in buses.items()}
        threads = [
            Thread(target=join, args=(bus, config, never, said[name]))
            for name, bus in buses.items()
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for name in ("r1", "r2", "operator"):
            buses[name].declare(READY)
        yield {n: TeamPace(buses[n], config, said[n]) for n in ("plant_r1", "plant_r2")}


def test_both_begin_at_one_instant_and_keep_the_pace_of_the_system_clock(
    paces: dict[str, TeamPace],
) -> None:
    leads, follows = paces["plant_r1"], paces["plant_r2"]
    walking, walked = dict[str, bool](), Event()

    def lead() -> None:
        leads.check_clock()
        walking["leader"] = leads.start(pause, never)
        while not walked.is_set():
            leads.wait()

    thread = Thread(target=lead)
    thread.start()
    try:
        follows.check_clock()
        walking["follower"] = follows.start(pause, never)
        begun = monotonic_ns()
        for _ in range(300):
            assert follows.wait() >= 0.0
        ended = monotonic_ns()
    finally:
        walked.set()
        thread.join()
    assert walking == {"leader": True, "follower": True}
    assert leads._start - MS < begun, "none begins before T0"
    assert ended > leads._start + 299 * MS
    assert abs(leads._start - follows._start) < MS, "here it is the same clock"
    assert not follows.start(pause, lambda: True), "it is told to stop"


def of_plant(config: Config, name: str) -> TeamPace:
    """One that has met nobody."""
    bus = SimpleNamespace(name=name, team="team")
    return TeamPace(cast("Bus", bus), config, cast("ProcessInfo", None))


def test_a_late_plant_catches_up_and_leaves_no_tick_out(
    config: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    pace, now = of_plant(config, "plant_r1"), [100 * S]
    monkeypatch.setattr(module, "monotonic_ns", lambda: now[0])

    def go_on(seconds: float) -> None:
        now[0] += max(round(1e9 * seconds), 0)

    monkeypatch.setattr(module, "sleep", go_on)
    pace._start = pace._begun = 100 * S
    assert [pace.wait() for _ in range(3)] == [0.0, 0.0, 0.0]
    now[0] += 5 * MS
    late = [pace.wait() for _ in range(12)]
    assert late == pytest.approx([4e-3 - 0.5e-3 * k for k in range(8)] + [0.0] * 4)
    assert now[0] == 100 * S + 15 * MS
    assert pace.overruns == 6


def of_clock(ahead_ms: float) -> MemberAnswer:
    """The lead's answer, whose clock is ahead of the asker's."""
    return answer(replace(SIM, wall_ns=SIM.wall_ns + round(ahead_ms * MS)), 200_000)


@pytest.mark.parametrize(
    ("said", "got"),
    [
        (of_clock(3.0), "3.0 ms behind that of plant_r1"),
        (of_clock(-7200e3), "7,200,000.0 ms ahead of that of plant_r1"),
        (None, "no answer of plant_r1"),
    ],
)
def test_a_clock_that_is_off_is_refused_and_the_remedy_named(
    config: Config, monkeypatch: pytest.MonkeyPatch, said: MemberAnswer | None, got: str
) -> None:
    monkeypatch.setattr(module, "ask_clock", lambda _bus, _name: said)
    with pytest.raises(BusError) as raised:
        of_plant(config, "plant_r2").check_clock()
    assert (raised.value.name, raised.value.got) == ("system clock of plant_r2", got)
    assert said is None or "PTP" in raised.value.cause
