"""Plants agree over the bus on one clock and on when to begin, or refuse to."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from threading import Event, Thread

import pytest

from quadriga.plant import team_pace as module
from quadriga.plant.team_clock import ENOUGH_NS
from quadriga.plant.team_pace import FollowingPace, LeadingPace, team_pace
from quadriga.shared.bus.discovery import join
from quadriga.shared.bus.membership import members
from quadriga.shared.bus.session import READY, Bus
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.runtime.clock import monotonic_ns, sleep
from quadriga.shared.wire import codes
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import ClockAnswer, ClockAsk
from quadriga.shared.wire.topics import CLOCK_ANSWER, CLOCK_ASK
from quadriga.team.endpoint import free_endpoint


@pytest.fixture
def config() -> Config:
    keys = {
        "team.robots": 2,
        "team.yokes": "none",
        "team.plants": "each",
        "world.mode": "realtime",
        "planner.kind": "none",
        "recorder.enabled": False,
        "bus.endpoint": free_endpoint(),
        "bus.barrier_timeout": 10.0,
    }
    return load(None, keys)


@pytest.fixture
def buses(config: Config) -> Iterator[dict[str, Bus]]:
    """One of each member, which the test lets meet."""
    with ExitStack() as stack:
        names = sorted(members(config), key=lambda name: name != "plant_r1")
        yield {n: stack.enter_context(Bus.open(config.bus, "team", n)) for n in names}


def never() -> bool:
    return False


def pause() -> None:
    sleep(0.002)


def all_meet(config: Config, buses: dict[str, Bus]) -> None:
    threads = [Thread(target=join, args=(bus, config, never)) for bus in buses.values()]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name, bus in buses.items():
        if not name.startswith("plant"):
            bus.declare(READY)


def test_only_plants_of_single_robots_in_real_time_have_a_pace(config: Config) -> None:
    lockstep = load(None, {"team.robots": 2, "team.yokes": "none", "team.plants": "each"})
    with Bus.open(config.bus, "team", "plant_r1") as bus:
        assert team_pace(bus, lockstep, "r1", is_robot=False) is None
        assert team_pace(bus, config, "", is_robot=False) is None
        assert isinstance(team_pace(bus, config, "r1", is_robot=True), LeadingPace)
        assert isinstance(team_pace(bus, config, "r2", is_robot=True), FollowingPace)


def test_both_know_one_clock_and_begin_at_one_instant_of_it(
    config: Config, buses: dict[str, Bus]
) -> None:
    leads = LeadingPace(buses["plant_r1"], config, "r1", slack=10**9)
    follows = FollowingPace(buses["plant_r2"], config, "r2", slack=10**9)
    all_meet(config, buses)
    walking, walked = dict[str, bool](), Event()

    def lead() -> None:
        walking["leader"] = leads.start(pause, never)
        while not walked.is_set():
            leads.wait()

    thread = Thread(target=lead)
    thread.start()
    try:
        walking["follower"] = follows.start(pause, never)
        begun = monotonic_ns()
        for _ in range(300):
            assert follows.wait() >= 0.0
        known = follows.clock.known(monotonic_ns())
    finally:
        walked.set()
        thread.join()
    assert walking == {"leader": True, "follower": True}
    assert follows.clock.start == leads.clock.start > 0
    assert known is not None
    assert abs(known.offset) <= known.error, "here it is the same clock"
    assert begun >= follows.clock.start - known.error
    assert follows.look() is None
    assert follows.clock.answers > leads.clock.slips


def test_a_clock_that_never_answers_is_one_clear_error(
    config: Config, buses: dict[str, Bus]
) -> None:
    impatient = replace(config, bus=replace(config.bus, barrier_timeout=0.3))
    follows = FollowingPace(buses["plant_r2"], impatient, "r2", slack=10**9)
    all_meet(config, buses)
    with pytest.raises(BusError, match=r"no answer of plant_r1 in 0.3 s, expected 1 ms at most"):
        follows.start(pause, never)


def test_a_network_that_is_too_slow_is_refused_and_its_round_trip_named(
    config: Config, buses: dict[str, Bus], monkeypatch: pytest.MonkeyPatch
) -> None:
    follows = FollowingPace(buses["plant_r2"], config, "r2", slack=10**9)
    asks = buses["plant_r1"].collect(CLOCK_ASK.key("team", "r2"))
    put = buses["plant_r1"].publisher(CLOCK_ANSWER.key("team", "r2"))
    all_meet(config, buses)
    monkeypatch.setattr(module, "_SETTLE_NS", 500_000_000)

    def slowly() -> None:
        """Wait, and say that it was the way and not the plant."""
        for at, _, payload in asks():
            sleep(0.01)
            put(encode(ClockAnswer(0, 0, decode(payload, ClockAsk).asked_ns, at, at, 0, 0, 0)))
        pause()

    with pytest.raises(BusError, match=r"up to \d+\.\d ms, a round trip of at least \d\d\.\d ms"):
        follows.start(slowly, never)
    assert follows.clock.error(monotonic_ns()) > ENOUGH_NS


def test_who_is_told_to_stop_while_it_waits_stops(config: Config, buses: dict[str, Bus]) -> None:
    follows = FollowingPace(buses["plant_r2"], config, "r2", slack=10**9)
    assert not follows.start(pause, lambda: True)


def test_a_plant_that_is_silent_ends_the_walk_and_is_named(
    config: Config, buses: dict[str, Bus]
) -> None:
    leads = LeadingPace(buses["plant_r1"], config, "r1", slack=10**9)
    now = monotonic_ns()
    leads.clock.start = now - 2 * 10**9
    leads.clock.walk(now - 2 * 10**9)
    end = leads.look()
    assert end == (codes.PLANT_GONE, "plant_r2 silent for 0.5 s")
