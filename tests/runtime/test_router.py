"""A team through a router: same walk, any order of starting, a clean end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from quadriga.shared.bus.session import Bus
from quadriga.shared.runtime.clock import monotonic, sleep
from tests.runtime.conftest import WAIT, Make, Team, run_alone
from tests.runtime.test_lockstep import payloads

QUADRIGA = (sys.executable, "-m", "quadriga")


@contextmanager
def router(team: Team, *options: str) -> Iterator[subprocess.Popen[str]]:
    """A router's process for `team`."""
    endpoint, timeout = team.config.bus.endpoint, team.config.bus.barrier_timeout
    command = (
        *QUADRIGA,
        "router",
        "--listen",
        endpoint,
        *options,
        "--set",
        f"bus.barrier_timeout={timeout}",
        "--parent",
        str(os.getpid()),
    )
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def await_routing(process: subprocess.Popen[str]) -> None:
    """Wait until the router has said where it listens."""
    assert process.stderr
    assert "routing at tcp/" in process.stderr.readline()


def test_the_same_walk_as_without_a_router_which_leaves_after_it(make_team: Make) -> None:
    team = make_team(recorder__enabled=True, world__duration=0.5)
    direct = payloads(team.run())
    team = make_team(recorder__enabled=True, world__duration=0.5, bus__mode="client")
    folder = team.folder / "routed"
    folder.mkdir()
    team = Team(team.config, folder)
    with team.launch() as running:
        sleep(0.5)  # the router comes last
        with router(team, "--once") as process:
            running.watch(lambda: False)
            assert process.wait(WAIT) == 0
    assert payloads(team.recording()) == direct


def test_a_router_stays_until_it_is_told_to_leave(make_team: Make) -> None:
    team = make_team(bus__mode="client", world__duration=0.5)
    with router(team) as process:
        await_routing(process)
        with team.launch() as running:
            running.watch(lambda: False)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT) == 0


def test_a_router_for_one_walk_does_not_wait_for_ever(make_team: Make) -> None:
    team = make_team(bus__barrier_timeout=0.1)
    with router(team, "--once") as process:
        _, errors = process.communicate(timeout=WAIT)
    assert process.returncode == 2
    assert "barrier of team 'team', seen by router: got no sim at stage 'ready'" in errors


def test_a_port_that_is_taken(make_team: Make) -> None:
    team = make_team()
    with Bus.route(team.config.bus.endpoint, "other"), router(team) as process:
        _, errors = process.communicate(timeout=WAIT)
    assert process.returncode == 2
    assert "another team or program listens there" in errors
    assert errors.count("\n") == 1


@pytest.mark.parametrize("name", ["sim", "r1", "operator", "recorder"])
def test_nobody_waits_for_a_router_for_ever(make_team: Make, name: str) -> None:
    team = make_team(bus__mode="client", bus__barrier_timeout=0.3, recorder__enabled=True)
    row = next(row for row in team.rows(standing=False) if row.name == name)
    status, errors = run_alone(row)
    assert status == 2
    waits, error = errors.splitlines()
    assert waits == f"quadriga: {name} waits for a router at {team.config.bus.endpoint}"
    assert "no router there" in error


def test_waiting_for_a_router_can_be_interrupted(make_team: Make) -> None:
    team = make_team(bus__mode="client")
    asked: list[float] = []

    def stopped() -> bool:
        asked.append(monotonic())
        return len(asked) == 3

    with pytest.raises(KeyboardInterrupt):
        Bus.open(team.config.bus, "team", "sim", stopped)
    assert asked[-1] - asked[0] < 5.0
