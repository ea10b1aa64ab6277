"""SHELL of `quadriga play`: a recording back on the bus, at a pace, with pauses and steps."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import inf
from typing import Final

from rich.console import Console
from rich.progress import TaskID

from quadriga.keyboard import Keyboard
from quadriga.playback.timeline import Timeline
from quadriga.playback.transport import Transport
from quadriga.progress import build_progress
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.config.sections import BusConfig
from quadriga.shared.errors import BusError, ConfigError
from quadriga.shared.members import OPERATOR, PLANNER, SIM
from quadriga.shared.runtime.clock import monotonic, sleep

PLAYER: Final = "player"
_SETTLE: Final = 0.6  # s, for listeners that try again to connect, and to see who is there
_LOOK: Final = 0.1  # s, between looks at keys, status line and presence while messages flow
_PAUSE, _STEP, _QUIT = "pause", "step", "quit"
_KEYS: Final = {b"\x1b[C": _STEP, b"\x1bOC": _STEP, b" ": _PAUSE, b"q": _QUIT, b"Q": _QUIT}
_SLACK: Final = 0.2  # s of delay that is made up for; a longer one is left behind
_MEMBER: Final = re.compile(rf"(plant_)?r\d+|{SIM}|{OPERATOR}|{PLANNER}|{PLAYER}")


def play(
    bus: BusConfig,
    timeline: Timeline,
    console: Console,
    *,
    rate: float,
    start: float,
    loop: bool,
    paused: bool,
) -> None:
    """Publish a recording until its end, a `q` or a signal.

    Args:
        bus: where.
        timeline: what.
        console: for the status line and the result.
        rate: world time per wall time.
        start: the world time to begin at, s.
        loop: begin again at the end.
        paused: begin paused.

    Raises:
        ConfigError: the rate is not positive, or the start is after its end.
        BusError: the bus cannot be opened, or a live team of that name is on it.
    """
    if not 0.0 < rate < inf:
        raise ConfigError("--rate", f"{rate:g}", "a number above 0")
    if not 0.0 <= 1000 * start <= timeline.last:
        raise ConfigError(
            "--start",
            f"{start:g} s",
            f"at most {timeline.last / 1000:g} s",
            "the recording ends there",
        )
    with Bus.join(bus, timeline.team, PLAYER) as joined, Keyboard(_KEYS) as keys:
        sleep(_SETTLE)
        _refuse_live(joined, bus.endpoint)
        joined.declare(HERE)  # only now: a player that came before must not be the one to leave
        begin = max(1000 * start, timeline.first)
        transport = Transport(rate, begin, monotonic(), paused=paused)
        with _Status(console, timeline, transport, keys.listens) as status:
            player = _Player(timeline, transport, keys, joined, status, bus.endpoint)
            while player.play(begin) and loop:
                transport.seek(begin, monotonic())
        spent = monotonic() - player.begun
    console.print(
        f"played {player.sent} messages as team {timeline.team!r} in {spent:.1f} s",
        markup=False,
        highlight=False,
    )


def _refuse_live(bus: Bus, endpoint: str) -> None:
    live = sorted(name for name in bus.members_at(HERE) if _MEMBER.fullmatch(name))
    if live:
        raise BusError(
            f"team {bus.team!r} at {endpoint}",
            f"{', '.join(live)} of a live team of that name",
            "nobody who publishes for it",
            f"--remap {bus.team}:ghost gives the recording another",
        )


class _Player:
    """Publishes cues when they are due, and obeys the keys meanwhile.

    Attributes:
        sent: messages published.
        begun: when it began, s of the clock.
    """

    def __init__(
        self,
        timeline: Timeline,
        transport: Transport,
        keys: Keyboard,
        bus: Bus,
        status: _Status,
        endpoint: str,
    ) -> None:
        self._timeline, self._transport, self._keys = timeline, transport, keys
        self._bus, self._status, self._endpoint = bus, status, endpoint
        self._put: dict[str, Callable[[bytes], None]] = {}
        self._looked = self.begun = monotonic()
        self.sent = 0

    def play(self, begin: float) -> bool:
        """Play from `begin` ms to the end; False if the user quit before."""
        for at, key, payload in self._timeline.cues(begin):
            if not self._wait(at):
                return False
            put = self._put.get(key)
            if put is None:
                put = self._put[key] = self._bus.publisher(key)
            put(payload)
            self.sent += 1
        return True

    def _wait(self, at: float) -> bool:
        """Wait until `at` ms is reached; False if the user quit before."""
        while True:
            now = monotonic()
            left = self._transport.until(at, now)
            late = now - self._looked > _LOOK
            if left <= 0.0 and not late:
                return True
            if late:
                self._looked = now
                self._status.show(self._transport.position(now))
                _refuse_live(self._bus, self._endpoint)
                self._transport.fall_behind(at, _SLACK, now)
            key = self._keys.get(min(left, _LOOK))
            now = monotonic()
            if key == _QUIT:
                return False
            if key == _PAUSE:
                self._transport.toggle(now)
            elif key == _STEP:
                self._transport.step(self._timeline.step, now)


class _Status:
    """The line that shows world time and rate, on a terminal."""

    def __init__(
        self, console: Console, timeline: Timeline, transport: Transport, keys: bool
    ) -> None:
        self._transport, self._last = transport, timeline.last
        self._hint = "  space pauses, → steps, q quits" if keys else ""
        self._bar = build_progress(console, "{task.fields[text]}")
        self._task: TaskID = self._bar.add_task("", total=timeline.last, text="")

    def show(self, position: float) -> None:
        """Show a position, ms."""
        shown = min(position, self._last)
        text = f"{shown / 1000:.2f}/{self._last / 1000:.2f} s  {self._transport.rate:g} ×"
        self._bar.update(
            self._task,
            completed=shown,
            text=text + self._hint,
            description="paused " if self._transport.paused else "playing",
        )

    def __enter__(self) -> _Status:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
