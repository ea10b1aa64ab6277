"""A look at a team on a real bus, and `quadriga status --watch` where there is none."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack

import numpy as np
import pytest

from quadriga.commands.parser import main
from quadriga.shared.bus.diagnostics import processes
from quadriga.shared.bus.discovery import ProcessInfo
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.codes import PUSH
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Clock, Event, Status
from quadriga.status import listen
from quadriga.status.listen import listening
from quadriga.team.endpoint import free_endpoint
from tests.listening import WAIT, await_listener


def config() -> Config:
    keys = {"team.robots": 2, "bus.endpoint": free_endpoint(), "recorder.enabled": False}
    return load(None, keys | {"planner.kind": "none"})


def assemble(stack: ExitStack, of: Config) -> dict[str, Bus]:
    """All processes of a team, ready, in this one."""
    buses = {}
    for member in processes(of):
        bus = stack.enter_context(Bus.open(of.bus, of.team.name, member.name))
        ProcessInfo(bus, of)
        buses[member.name] = bus
    for stage in (HERE, READY):
        for bus in buses.values():
            bus.declare(stage)
    return buses


def walks(tick: int, mode: str = "walk", reason: str = "") -> bytes:
    costs = np.array([100.0])
    return encode(Status(tick, 0, mode, reason, "kalman", {"reference": 0.0}, {}, costs, costs))


def test_a_team_on_the_bus() -> None:
    of = config()
    with ExitStack() as stack:
        buses = assemble(stack, of)
        listener = stack.enter_context(listening(of, "status", lambda: False))
        await_listener(buses["sim"], "team/clock")
        await_listener(buses["sim"], "team/sim/event")
        await_listener(buses["r1"], "team/r1/status")
        assert listener.look().problems == ()  # it has not begun
        for tick in range(1000, 1200, 10):
            buses["sim"].publisher("team/clock")(encode(Clock(tick, 0)))
        buses["sim"].publisher("team/sim/event")(encode(Event.of(1100, PUSH, "r1", "80 N")))
        buses["r1"].publisher("team/r1/status")(walks(1190))
        buses["r2"].publisher("team/r2/status")(walks(1190, "stand", "led-down"))
        listener.hear(0.3, lambda: False)
        status = listener.look()
        assert status.reading.tick == 1190
        assert status.problems == ("r2 is in mode stand, led-down",)
        r1 = status.members[1]
        assert (r1.name, r1.here, r1.health) == ("r1", True, "well")
        assert r1.account is not None
        assert r1.account.mode == "walk"
        assert r1.use is not None
        assert r1.use.pid == os.getpid()
        topics = {topic.key: topic for topic in status.reading.topics}
        assert (topics["team/clock"].messages, topics["team/clock"].lost) == (20, 0)
        assert status.reading.events == ("1100 ms: push r1 80 N",)  # once
        buses.pop("operator").close()
        listener.hear(0.3, lambda: False)
        assert "operator: not well: gone" in listener.look().problems


def test_who_is_not_there_makes_the_status_1(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(listen, "_LINK_TIMEOUT", 0.1)
    words = ["--json", "--seconds-heard", "0.1", "--endpoint", free_endpoint()]
    assert main(["status", *words]) == 1
    out, err = capsys.readouterr()
    body = json.loads(out)
    assert (err, body["well"]) == ("", False)
    assert body["problems"][0].startswith("nobody of team 'team'")
    assert main(["status", "--seconds-heard", "nan"]) == 2


@pytest.mark.parametrize("words", [("--every", "2"), ("--watch", "--json"), ("-n", "0")])
def test_an_option_that_would_be_ignored_is_refused(
    words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["status", *words]) == 2
    assert "--watch beside it" in capsys.readouterr().err


def test_watch_without_a_terminal_prints_lines_until_it_is_interrupted() -> None:
    options = ("--watch", "--endpoint", free_endpoint(), "--every", "0.2")
    watch = subprocess.Popen(
        [sys.executable, "-m", "quadriga", "status", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert watch.stdout is not None
    assert watch.stdout.readline().startswith("team 'team' at tcp/127.")
    assert "\x1b" not in watch.stdout.readline()
    watch.send_signal(signal.SIGINT)
    _, err = watch.communicate(timeout=WAIT)
    assert (watch.returncode, err) == (0, "")
