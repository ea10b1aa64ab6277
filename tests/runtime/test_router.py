"""A team's router: who waits for it, and when it leaves."""

from __future__ import annotations

import signal

import pytest

from quadriga.shared.bus.session import Bus
from quadriga.shared.runtime.clock import monotonic
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT
from tests.runtime.conftest import Make, router, run_command


def test_a_router_stays_until_it_is_told_to_leave(make_team: Make) -> None:
    team = make_team(bus__mode="client", world__duration=0.5)
    with router(team.config.bus.endpoint) as process:
        with team.launch() as running:
            running.watch(lambda: False)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT) == 0


def test_a_router_for_one_walk_does_not_wait_for_ever() -> None:
    options = ("--once", "--set", "bus.barrier_timeout=0.1")
    with router(free_endpoint(), *options, says="") as process:
        _, errors = process.communicate(timeout=WAIT)
    assert process.returncode == 2
    assert "got no sim after 0.3 s, expected a walk" in errors


def test_a_port_that_is_taken() -> None:
    endpoint = free_endpoint()
    with Bus.route(endpoint, "other"), router(endpoint, says="") as process:
        _, errors = process.communicate(timeout=WAIT)
    assert process.returncode == 2
    assert "another team or program listens there" in errors
    assert errors.count("\n") == 1


@pytest.mark.parametrize("name", ["sim", "operate"])
def test_nobody_waits_for_a_router_for_ever(make_team: Make, name: str) -> None:
    team = make_team(bus__mode="client", bus__barrier_timeout=0.3)
    status, errors = run_command(name, "--config", team.file)
    assert status == 2
    waits, error = errors.splitlines()
    assert waits.endswith(f"waits for a router at {team.config.bus.endpoint}")
    assert "no router there" in error


def test_waiting_for_a_router_can_be_interrupted(make_team: Make) -> None:
    asked: list[float] = []

    def stopped() -> bool:
        asked.append(monotonic())
        return len(asked) == 3

    with pytest.raises(KeyboardInterrupt):
        Bus.open(make_team(bus__mode="client").config.bus, "team", "sim", stopped)
    assert asked[-1] - asked[0] < 5.0
