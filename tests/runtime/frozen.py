"""A robot's process that stands still for a while and is back before the world has ended."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from typing import Final

import pytest

from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.codes import SILENT
from quadriga.shared.messages import Command, Event, Truth
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import COMMAND, EVENT, TRUTH
from quadriga.team.launch import Launch
from tests.runtime.conftest import WAIT

TEAM: Final = "team"
PATIENCE: Final = 3.0  # s, `world.command_timeout`: more than a busy machine takes for a tick


def payloads(bus: Bus, key: str) -> Iterator[bytes]:
    """What is published on a key, as it is heard."""
    deadline = monotonic() + WAIT
    while monotonic() < deadline:
        packet = bus.get(1.0)
        if packet is not None and packet[0] == key:
            yield packet[1]
    pytest.fail(f"nothing more is heard on {key}")


def await_tick(bus: Bus, tick: int) -> int:
    """The world's time, as soon as it is `tick` or later."""
    found = (decode(payload, Truth).tick for payload in payloads(bus, TRUTH.key(TEAM)))
    return next(now for now in found if now >= tick)


def await_event(bus: Bus, robot: str, code: str) -> int:
    """When an event of a robot of this code happens, in ticks."""
    events = (decode(payload, Event) for payload in payloads(bus, EVENT.key(TEAM)))
    return next(event.tick for event in events if event.robot == robot and event.code == code)


def freeze(running: Launch, bus: Bus, robot: str, tick: int, ticks: int) -> None:
    """Freeze a robot at a tick until the world has gone on without it for so many more.

    The world stands still while the robot wakes up: without it the team falls, and a world in
    which it has fallen soon ends, maybe before a busy machine lets the process run again.
    """
    pids = running.pids
    await_tick(bus, tick)
    os.kill(pids[robot], signal.SIGSTOP)
    now = await_tick(bus, await_event(bus, robot, SILENT) + ticks)
    os.kill(pids["sim"], signal.SIGSTOP)
    for key, payload in bus.drain():
        if key == TRUTH.key(TEAM):
            now = decode(payload, Truth).tick
    os.kill(pids[robot], signal.SIGCONT)
    answers = (decode(payload, Command) for payload in payloads(bus, COMMAND.key(TEAM, robot)))
    # The newest states may not have left the world's process, which stands still.
    next(answer for answer in answers if answer.tick > now - ticks // 2)
    os.kill(pids["sim"], signal.SIGCONT)
