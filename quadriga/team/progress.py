"""The line a user watches while the team walks, from what is on the bus."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Final, Self

import numpy as np
from rich.console import Console

from quadriga.plant.deadlines import MODE as REALTIME
from quadriga.progress import build_progress
from quadriga.recordings.late_commands import late_shares, overloaded
from quadriga.shared.bus.diagnostics import members
from quadriga.shared.bus.session import HERE, READY, Bus
from quadriga.shared.codec import decode
from quadriga.shared.codes import DOWN
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.members import LAUNCHER, LEADS
from quadriga.shared.messages import Clock, Event, Status, Truth
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import CLOCK, STATUS, TRUTH, topics_for

_TELL_EVERY: Final = 10.0  # s wall between two lines of how far a walk has come, without a terminal
_ABSENT_EVERY: Final = 2.0  # s wall between two lines of who is awaited
_COMPLAIN_EVERY: Final = 5.0  # s of the world between two complaints that commands come late


class WalkProgress:
    """Follows the walk on the bus and shows it; a context that must be entered.

    Attributes:
        fallen: robots that have fallen so far.
    """

    def __init__(self, config: Config, console: Console) -> None:
        self._config, self._console = config, console
        self._bus = Bus.open(config.bus, config.team.name, LAUNCHER)
        team = config.team.name
        for topic in topics_for(LAUNCHER):
            if topic not in (CLOCK, TRUTH):
                self._bus.subscribe(topic.key(team, "*"))
        self._clock = self._bus.keep_newest(CLOCK.key(team))
        self._truth = self._bus.keep_newest(TRUTH.key(team))
        self._bar = build_progress(console, "{task.fields[text]}", hidden=False)
        self._task = self._bar.add_task("starting", total=config.world.duration, text="")
        self._begun = self._told = 0.0
        self._text, self._walks = "", False
        self._counted: dict[str, Mapping[str, int]] = {}  # by plant what it had counted
        self._complained = -1000 * _COMPLAIN_EVERY  # tick of the last complaint
        self._speed = ""  # unknown of robots whose plant does not know it
        self.fallen: list[str] = []

    def update(self) -> None:
        """Show what has arrived since the last call."""
        for key, payload in self._bus.drain():
            try:
                if key.endswith(f"/{STATUS.name}"):
                    self._note_status(key.split("/")[1], decode(payload, Status))
                else:
                    self._show_event(decode(payload, Event))
            except MessageError:
                continue  # the recorder keeps it
        with suppress(MessageError):
            if (truth := self._truth()) is not None:
                velocity = decode(truth, Truth).base_vel.mean(axis=0)
                self._speed = f"{float(np.linalg.norm(velocity[:2])):.2f} m/s  "
        clock = self._clock()
        if clock is not None:
            with suppress(MessageError):
                self._show_time(decode(clock, Clock).tick / 1000)
        elif not self._begun:
            self._show_absent()

    def _show_event(self, event: Event) -> None:
        if event.code in DOWN:
            self.fallen.append(event.robot)
        if event.kind in ("fall", "fault", "push"):
            line = f"{event.tick / 1000:.2f} s: {event.kind} {event.robot} {event.detail}"
            self._bar.console.print(printable_line(line), markup=False)

    def _note_status(self, name: str, status: Status) -> None:
        """Of a plant in real time: complain while commands come late too often."""
        if status.mode != REALTIME:
            return
        late = overloaded(late_shares(self._counted.get(name, {}), status.counters))
        self._counted[name] = status.counters
        if late and status.tick - self._complained >= 1000 * _COMPLAIN_EVERY:
            self._complained = status.tick
            shares = ", ".join(f"{share:.0%} of {robot}'s" for robot, share in late.items())
            line = f"{status.tick / 1000:.2f} s: overload: {shares} commands come late"
            self._bar.console.print(printable_line(line), style="yellow", markup=False)

    def _tell(self, text: str) -> None:
        """Without a terminal a bar is seen at its end alone: say how far it is in a line."""
        if not self._console.is_terminal and text != self._text:
            self._text, self._told = text, monotonic()
            self._console.print(printable_line(text), markup=False, highlight=False)

    def _show_absent(self) -> None:
        team = members(self._config)
        absent = team - self._bus.members_at(HERE) or team - LEADS - self._bus.members_at(READY)
        text = f"waiting for {', '.join(sorted(absent))}" if absent else ""
        self._bar.update(self._task, text=text)
        if monotonic() - self._told > _ABSENT_EVERY:
            self._tell(text)

    def _show_time(self, seconds: float) -> None:
        now = monotonic()
        self._begun = self._begun or now - seconds
        pace = seconds / max(now - self._begun, 1e-3)
        so_far = f"{seconds:.1f}/{self._config.world.duration:g} s  {self._speed}"
        text = f"{so_far}{pace:.2f} × real time"
        self._bar.update(self._task, description="walking", completed=seconds, text=text)
        if not self._walks or now - self._told > _TELL_EVERY:
            self._tell(f"walking {text}" if self._walks else "walking")
            self._walks = True

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
        self._bus.close()
