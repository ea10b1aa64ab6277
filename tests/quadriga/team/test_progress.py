"""The progress line follows the clock, and shows a speed where the truth is known."""

from __future__ import annotations

import io
from contextlib import ExitStack

import numpy as np
import pytest
from rich.console import Console

from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.members import SIM
from quadriga.shared.messages import Clock, Event, Status, Truth
from quadriga.shared.runtime.clock import monotonic, sleep
from quadriga.shared.topics import CLOCK, EVENT, STATUS, TRUTH
from quadriga.team.endpoint import free_endpoint
from quadriga.team.progress import WalkProgress
from tests.listening import await_listener

WAIT = 20.0  # s


@pytest.mark.parametrize("known", [True, False])
def test_time_is_the_clock_s_and_speed_the_truth_s(known: bool) -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint(), "world.duration": 8.0})
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=120)
    with Bus.open(config.bus, "team", SIM) as sim:
        clock, truth = sim.publisher(CLOCK.key("team")), sim.publisher(TRUTH.key("team"))
        still = (np.zeros((1, 4)), np.array([[0.3, 0.4, 0.0]]), np.zeros((1, 3)))
        none = (np.zeros((1, 4, 3)), np.zeros(0), np.zeros(0))
        with WalkProgress(config, console) as progress:
            deadline = monotonic() + WAIT
            while "2.5/8 s" not in text.getvalue():
                assert monotonic() < deadline, text.getvalue()
                if known:
                    truth(encode(Truth(2500, 0, ("r1",), np.zeros((1, 3)), *still, *none)))
                clock(encode(Clock(2500, 0)))
                sleep(0.05)
                progress.update()
    assert ("0.50 m/s" in text.getvalue()) == known


def test_an_event_that_would_steer_the_terminal_is_only_shown() -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint(), "world.duration": 8.0})
    text = io.StringIO()
    console = Console(file=text, force_terminal=False, width=120)
    with Bus.open(config.bus, "team", SIM) as sim, WalkProgress(config, console) as progress:
        put, deadline = sim.publisher(EVENT.key("team")), monotonic() + WAIT
        while "harmless" not in text.getvalue():
            assert monotonic() < deadline, text.getvalue()
            detail = "\x1b]0;mine\x07\x1b[2J\nquadriga: harmless"
            put(encode(Event(500, 0, "fault", "r1\x1b[8m", detail, "malformed")))
            sleep(0.05)
            progress.update()
    assert "\x1b" not in text.getvalue()
    assert "\nquadriga: harmless" not in text.getvalue()


def test_before_the_walk_those_who_are_awaited_are_named() -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint()})
    text = io.StringIO()
    console = Console(file=text, force_terminal=True, width=120)

    def await_text(wanted: str) -> None:
        deadline = monotonic() + WAIT
        while wanted not in text.getvalue():
            assert monotonic() < deadline, text.getvalue()
            progress.update()
            sleep(0.05)

    with ExitStack() as stack:
        names = (SIM, "r1", "operator", "recorder")
        buses = {n: stack.enter_context(Bus.open(config.bus, "team", n)) for n in names}
        progress = stack.enter_context(WalkProgress(config, console))
        for name in (SIM, "operator"):
            buses[name].declare(HERE)
        await_text("waiting for r1, recorder")
        for name in ("r1", "recorder"):
            buses[name].declare(HERE)
        for name in ("r1", "recorder"):
            buses[name].declare(READY)
        await_text("waiting for operator")


def test_without_a_terminal_lines_tell_what_a_bar_would_show() -> None:
    config = load(None, {"team.robots": 1, "bus.endpoint": free_endpoint(), "world.duration": 8.0})
    text = io.StringIO()
    console = Console(file=text, force_terminal=False, width=120)
    with ExitStack() as stack:
        sim = stack.enter_context(Bus.open(config.bus, "team", SIM))
        progress = stack.enter_context(WalkProgress(config, console))
        sim.declare(HERE)
        put, deadline = sim.publisher(CLOCK.key("team")), monotonic() + WAIT
        while "walking" not in text.getvalue():
            assert monotonic() < deadline, text.getvalue()
            if "waiting for operator, r1, recorder\n" in text.getvalue():
                put(encode(Clock(2500, 0)))
            progress.update()
            sleep(0.02)


def test_commands_that_come_too_late_are_complained_of_while_it_happens() -> None:
    keys = {"team.robots": 2, "bus.endpoint": free_endpoint(), "world.mode": "realtime"}
    config = load(None, keys)
    text = io.StringIO()
    console = Console(file=text, force_terminal=False, width=120)
    none = np.zeros(0)
    with Bus.open(config.bus, "team", SIM) as sim, WalkProgress(config, console) as progress:
        await_listener(sim, STATUS.key("team", SIM))
        put = sim.publisher(STATUS.key("team", SIM))
        late = {1000: 20, 2000: 420, 3000: 900, 9000: 4000}  # so many of r2's, counted by tick
        for tick, count in late.items():
            counters = {"r1.due": tick, "r1.late": 9, "r2.due": tick, "r2.late": count}
            put(encode(Status(tick, 0, "realtime", "", "", {}, counters, none, none)))
        deadline = monotonic() + WAIT
        while text.getvalue().count("overload") < 2:
            assert monotonic() < deadline, text.getvalue()
            progress.update()
            sleep(0.02)
    lines = [line for line in text.getvalue().splitlines() if "overload" in line]
    assert lines == [  # one in five seconds of the world
        "2.00 s: overload: 40% of r2's commands come late",
        "9.00 s: overload: 52% of r2's commands come late",
    ]
