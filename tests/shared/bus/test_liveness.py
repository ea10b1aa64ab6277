"""Who is left alone in the midst of a walk says what has vanished, once last words had time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest

from quadriga.shared.bus import liveness
from quadriga.shared.bus.liveness import Liveness, Loss, find_loss, loss_error, missed_ns_of
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codes import LEAD_GONE, LINK_LOST
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.members import SIM
from quadriga.shared.runtime.clock import monotonic, sleep, wall_ns
from quadriga.team.endpoint import free_endpoint

WAIT = 20.0  # s


@pytest.fixture(autouse=True)
def _few_last_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(liveness, "LAST_PACKETS", 0.2)


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = monotonic() + WAIT
    while not condition():
        assert monotonic() < deadline
        sleep(0.005)


@contextmanager
def together(config: Config) -> Iterator[tuple[Bus, Bus]]:
    """Who drives time, and an agent that sees it."""
    sim, r1 = (Bus.open(config.bus, "team", name) for name in (SIM, "r1"))
    with sim, r1:
        sim.declare(HERE)
        wait_until(lambda: SIM in r1.members_at(HERE))
        yield sim, r1


def complaint(watch: Liveness, tick: int) -> tuple[str, float]:
    """What is said in the end, and after how many seconds."""
    begun = monotonic()
    while monotonic() < begun + WAIT:
        try:
            watch.poll(tick)
        except ProcessError as error:
            return str(error), monotonic() - begun
        sleep(0.01)
    pytest.fail("nobody has complained")


def test_who_drives_time_is_missed_after_its_last_words() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with together(config) as (sim, r1):
        watch = Liveness(r1, config)
        watch.poll(1)
        assert find_loss(r1, config) is None
        left_ns = wall_ns()
        sim.close()
        wait_until(lambda: not r1.members_at(HERE))
        assert find_loss(r1, config) == (LEAD_GONE, "process sim of team 'team', seen by r1")
        said, after = complaint(watch, 1234)
        ended_ns = wall_ns()
    assert left_ns - 1_000_000 <= missed_ns_of(said) <= ended_ns - round(0.2e9)
    assert said.startswith(
        "process sim of team 'team', seen by r1: got none any more after 1.234 s of the walk"
    )
    assert after >= 0.2


def test_a_walk_is_over_once_who_announced_its_end_is_gone() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with together(config) as (sim, r1):
        watch = Liveness(r1, config)
        assert not watch.is_over(announced=False)
        assert not watch.is_over(announced=True)
        sim.close()
        wait_until(lambda: not r1.members_at(HERE))
        assert watch.is_over(announced=True)
        assert not watch.is_over(announced=False), "then it is missed"


def test_a_walk_that_goes_on_is_not_over_whatever_is_announced() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with together(config) as (_, r1):
        watch = Liveness(r1, config)
        begun = monotonic()
        while monotonic() < begun + 0.6:
            assert not watch.is_over(announced=True)
            sleep(0.02)
            watch.receive()
        begun = monotonic()
        wait_until(lambda: watch.is_over(announced=True))
        assert monotonic() - begun >= 0.2


def test_a_link_that_is_gone_is_named_and_not_those_behind_it() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    router = Bus.route(config.bus.endpoint, "team")
    config = replace(config, bus=replace(config.bus, mode="client"))
    with together(config) as (_, r1):
        watch = Liveness(r1, config)
        watch.poll(1)
        router.close()
        wait_until(lambda: find_loss(r1, config) is not None)
        loss = find_loss(r1, config)
        said, _ = complaint(watch, 5)
    assert loss is not None
    assert loss.code == LINK_LOST
    assert said.startswith(f"link of r1 to the router at {config.bus.endpoint}: got none any more")


def routed(**more: object) -> Config:
    """Of a team that waits for its router."""
    keys = {"bus.mode": "client", "world.mode": "realtime", "bus.endpoint": free_endpoint()}
    return load(None, {**keys, **more})


def test_a_router_that_is_started_again_is_waited_for() -> None:
    """So is who drives time, whose process finds the router by itself."""
    config = routed()
    router = Bus.route(config.bus.endpoint, "team")
    with together(config) as (sim, r1):
        heard = r1.collect("team/clock")
        watch = Liveness(r1, config)
        router.close()
        wait_until(lambda: find_loss(r1, config) is not None)
        watch.poll(1)
        sleep(0.4)  # longer than last words
        watch.poll(2)
        with Bus.route(config.bus.endpoint, "team"):
            wait_until(lambda: find_loss(r1, config) is None)
            watch.poll(3)
            put = sim.publisher("team/clock")
            wait_until(lambda: put(b"12") or bool(heard()))
            assert SIM in r1.members_at(HERE)


@pytest.mark.parametrize(
    "keys", [{"world.mode": "lockstep"}, {"bus.reconnect_timeout": 0.0}], ids=["lockstep", "never"]
)
def test_a_router_is_not_waited_for_where_that_is_no_use(keys: dict[str, object]) -> None:
    config = routed(**keys)
    router = Bus.route(config.bus.endpoint, "team")
    with together(config) as (_, r1):
        watch = Liveness(r1, config)
        router.close()
        wait_until(lambda: find_loss(r1, config) is not None)
        assert complaint(watch, 5)[1] < 5.0


def test_who_is_back_in_time_is_not_missed() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with together(config) as (sim, r1):
        watch = Liveness(r1, config)
        sim.withdraw()
        wait_until(lambda: not r1.members_at(HERE))
        watch.poll(1)
        sim.declare(HERE)
        wait_until(lambda: SIM in r1.members_at(HERE))
        watch.poll(2)
        sim.withdraw()
        wait_until(lambda: not r1.members_at(HERE))
        assert complaint(watch, 3)[1] >= 0.2


def test_a_line_tells_since_when_something_is_missed() -> None:
    loss, missed_ns = Loss(LEAD_GONE, "process sim"), 1_796_000_000_123_000_000
    said = str(loss_error(loss, 2500, missed_ns))
    assert "after 2.500 s of the walk, missed since 2026-11-30T00:53:20.123Z, expected" in said
    assert missed_ns_of(f"quadriga: {said}") == missed_ns
    assert missed_ns_of(str(loss_error(loss, 2500))) == 0
