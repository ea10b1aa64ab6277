"""Who is left alone in the midst of a walk says what has vanished, once last words had time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from quadriga.shared.bus import liveness
from quadriga.shared.bus.liveness import Liveness, find_loss
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codes import LEAD_GONE, LINK_LOST
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.members import SIM
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.team.endpoint import free_endpoint
from tests.shared.bus.test_session import WAIT, wait_until


@pytest.fixture(autouse=True)
def _few_last_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(liveness, "LAST_PACKETS", 0.2)


@contextmanager
def together(config: Config) -> Iterator[tuple[Bus, Bus]]:
    """Who drives time, and an agent that sees it."""
    sim, r1 = (Bus.open(config.bus, "team", name) for name in (SIM, "r1"))
    with sim, r1:
        sim.declare(HERE)
        wait_until(lambda: SIM in r1.members_at(HERE))
        yield sim, r1


def complaint(watch: Liveness, tick: int) -> str:
    """What is said in the end."""
    deadline = monotonic() + WAIT
    with pytest.raises(ProcessError) as caught:  # noqa: PT012
        while monotonic() < deadline:
            watch.poll(tick)
    return str(caught.value)


def test_who_drives_time_is_missed_after_its_last_words() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with together(config) as (sim, r1):
        watch = Liveness(r1, config)
        watch.poll(1)
        assert not watch.is_over(announced=False)
        assert not watch.is_over(announced=True)
        begun = monotonic()
        sim.close()
        wait_until(lambda: not r1.members_at(HERE))
        assert find_loss(r1, config) == (LEAD_GONE, "process sim of team 'team', seen by r1")
        said = complaint(watch, 1234)
        assert monotonic() - begun >= 0.2
        assert watch.is_over(announced=True)
        assert not watch.is_over(announced=False), "then it is missed"
    assert said.startswith(
        "process sim of team 'team', seen by r1: got none any more after 1.234 s of the walk"
    )


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


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_a_link_that_is_gone_is_named_and_not_those_behind_it(mode: str) -> None:
    keys = {"bus.mode": "client", "bus.endpoint": free_endpoint(), "world.mode": mode}
    config = load(None, keys)
    router = Bus.route(config.bus.endpoint, "team")
    with together(config) as (_, r1):
        watch = Liveness(r1, config)
        watch.poll(1)
        router.close()
        wait_until(lambda: find_loss(r1, config))
        loss, said = find_loss(r1, config), complaint(watch, 5)
    assert loss is not None
    assert loss.code == LINK_LOST
    assert said.startswith(f"link of r1 to the router at {config.bus.endpoint}: got none any more")


def test_who_is_back_in_time_is_not_missed() -> None:
    config = load(None, {"bus.endpoint": free_endpoint()})
    with together(config) as (sim, r1):
        watch = Liveness(r1, config)
        sim.close()
        wait_until(lambda: not r1.members_at(HERE))
        watch.poll(1)
        with Bus.open(config.bus, "team", SIM) as again:
            again.declare(HERE)
            wait_until(lambda: r1.members_at(HERE))
            sleep(0.25)
            watch.poll(1)
        wait_until(lambda: not r1.members_at(HERE))
        watch.poll(1)
        sleep(0.25)
        with pytest.raises(ProcessError):
            watch.poll(1)
