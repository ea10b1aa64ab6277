"""What the recording is told of a fault, by a recorder that hears it on the bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from quadriga.faults.fault import Stage
from quadriga.faults.teller import FaultTeller
from quadriga.shared import codes
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.members import LAUNCHER, RECORDER, SIM
from quadriga.shared.messages import Clock, Event
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import CLOCK, INJECTED
from quadriga.team.endpoint import free_endpoint

WAIT = 10.0  # s


@pytest.fixture
def config() -> Config:
    return load(None, {"bus.endpoint": free_endpoint()})


@pytest.fixture
def sim(config: Config) -> Iterator[Bus]:
    with Bus.open(config.bus, "team", SIM) as bus:
        yield bus


def open_recorder(config: Config) -> Bus:
    bus = Bus.open(config.bus, "team", RECORDER)
    bus.subscribe(INJECTED.key("team"))
    return bus


def await_word(told: Callable[[], bool]) -> None:
    deadline = monotonic() + WAIT
    while not told():
        assert monotonic() < deadline
        sleep(0.02)


def run_clock(sim: Bus, teller: FaultTeller, tick: int) -> None:
    put = sim.publisher(CLOCK.key("team"))

    def shows() -> bool:
        put(encode(Clock(tick, 0)))
        return teller.read_clock() == tick

    await_word(shows)


def hear(recorder: Bus, count: int) -> list[Event]:
    packets = list[bytes]()

    def all_there() -> bool:
        packets.extend(payload for _, payload in recorder.drain())
        return len(packets) >= count

    await_word(all_there)
    return [decode(payload, Event) for payload in packets]


def test_a_fault_is_told_with_its_robot_its_tick_and_its_end(config: Config, sim: Bus) -> None:
    stage = Stage(config, robot="r2", detail="of r2, by +1 s", lasts=0.0)
    with open_recorder(config) as recorder, Bus.open(config.bus, "team", LAUNCHER) as bus:
        recorder.declare(HERE)
        teller = FaultTeller(bus, "clock-step", stage)
        run_clock(sim, teller, 1700)
        teller.tell_begin(2000)
        run_clock(sim, teller, 2500)
        with teller.telling_end(monotonic()):
            begins, ends = hear(recorder, 2)
    assert begins == Event.of(2000, codes.FAULT_BEGINS, "r2", "clock-step: of r2, by +1 s")
    assert ends == Event.of(2500, codes.FAULT_ENDS, "r2", "clock-step is over")


def test_who_records_only_afterwards_hears_that_it_is_over(config: Config, sim: Bus) -> None:
    with Bus.open(config.bus, "team", LAUNCHER) as bus:
        teller = FaultTeller(bus, "recorder-paused", Stage(config, lasts=0.0))
        run_clock(sim, teller, 2500)
        with teller.telling_end(monotonic()), open_recorder(config) as recorder:
            (ends,) = hear(recorder, 1)
    assert ends == Event.of(2500, codes.FAULT_ENDS, "", "recorder-paused is over")


def test_an_end_that_no_clock_has_told_is_where_the_walk_was_by_this_computers(
    config: Config, sim: Bus
) -> None:
    with open_recorder(config) as recorder, Bus.open(config.bus, "team", LAUNCHER) as bus:
        recorder.declare(HERE)
        teller = FaultTeller(bus, "router-paused", Stage(config, lasts=0.0))
        run_clock(sim, teller, 2000)
        struck = monotonic()
        with teller.telling_end(struck):
            sleep(0.3)
            sim.publisher(CLOCK.key("team"))(encode(Clock(5000, 0)))
            (ends,) = hear(recorder, 1)
    assert 5000 - 1000 * (monotonic() - struck) <= ends.tick <= 5000 - 250


@pytest.mark.parametrize("lasts", [None, 60.0])
def test_of_what_is_not_over_when_the_walk_is_nobody_hears_an_end(
    config: Config, sim: Bus, lasts: float | None
) -> None:
    with open_recorder(config) as recorder, Bus.open(config.bus, "team", LAUNCHER) as bus:
        teller = FaultTeller(bus, "agent-killed", Stage(config, robot="r1", lasts=lasts))
        run_clock(sim, teller, 1700)
        teller.tell_begin(2000)
        begun = monotonic()
        with teller.telling_end(begun):
            (begins,) = hear(recorder, 1)
        assert monotonic() - begun < WAIT
        sleep(0.1)
        assert recorder.drain() == []
    assert begins == Event.of(2000, codes.FAULT_BEGINS, "r1", "agent-killed")
