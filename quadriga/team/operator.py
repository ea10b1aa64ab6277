"""SHELL of the operator: the team's velocity reference ahead of time."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from quadriga.drive.client import socket_path
from quadriga.drive.controls import DriveControls
from quadriga.drive.server import DriveServer
from quadriga.shared import members
from quadriga.shared.bus.discovery import join
from quadriga.shared.bus.liveness import Liveness
from quadriga.shared.bus.session import POLL, READY, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.reference_trace import trace_of
from quadriga.shared.config.sections import BY_HAND, Config
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import Clock, Event, Reference
from quadriga.shared.runtime.places import make_runtime_dir
from quadriga.shared.runtime.scheduling import at_work
from quadriga.shared.runtime.signals import stop_on_signals
from quadriga.shared.topics import CLOCK, EVENT, REFERENCE
from quadriga.shared.topics import REFERENCE_EPOCH_MS as EPOCH_MS
from quadriga.team.driven import LOOK, DrivenReferences

_AHEAD: Final = 4  # epochs; agents in lock-step wait for the one in force
_DRIVEN_AHEAD: Final = 1  # likewise, of who is driven by hand in real time: not to be felt
_GAP_MS: Final = 500  # at most, by which an announced end is ahead of the clock


def reference_at(config: Config, tick: int) -> Reference:
    """The reference for `tick`: nothing while the team stands, then a linear ramp to full speed.

    Full speed is the configured one, or what the configured trace asks for at that time.

    Raises:
        ConfigError: the trace cannot be read, or is none.
    """
    full, trace = config.reference, trace_of(config)
    since_start = tick - config.gait.stand_ms
    ramp_ms = 1000 * full.ramp
    factor = min(1.0, max(0, since_start) / ramp_ms) if ramp_ms else float(since_start >= 0)
    vx, vy, wz = full.vx, full.vy, full.wz
    if trace is not None:
        vx, vy, wz = trace.at(1e-3 * max(0, since_start))
    return Reference(tick, tick * 1_000_000, factor * vx, factor * vy, factor * wz, full.height)


def references_of(config: Config) -> Callable[[int], Reference | None]:
    """What the operator sends at a tick, as a rollout takes it: a reference at each epoch's begin.

    Raises:
        ConfigError: when it is called: the trace cannot be read, or is none.
    """
    return lambda tick: None if tick % EPOCH_MS else reference_at(config, tick)


def run(config: Config, stopped: Callable[[], bool] | None = None, view: str = "") -> None:
    """Publish the reference, following the team's clock, until the walk ends or it is stopped.

    Args:
        config: the team's configuration.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.
        view: URL of the picture in the page to drive from; "": none.

    Raises:
        BusError: the bus cannot be opened, or the team is not complete in time.
        ProcessError: who drives time, or the link to the router, has vanished.
    """
    stopped = stopped or stop_on_signals()
    team = config.team.name
    with Bus.open(config.bus, team, members.OPERATOR, stopped) as bus:
        for topic in (CLOCK, EVENT):
            bus.subscribe(topic.key(team))
        controls = DriveControls(config, bus, drivable=config.reference.driver == BY_HAND)
        port = config.reference.page_port if controls.drivable else None
        with DriveServer(controls, port, _socket_path(team), view) as server:
            if server.url:
                # The token drives the team, and this may be a log that others read.
                page = server.url.partition("?")[0]
                print(f"page to drive from: {page}; `quadriga drive` tells its token", flush=True)
            if not join(bus, config, stopped):
                return
            with at_work(config.runtime.priority):  # without a reference the robots stop
                _Operator(config, bus, controls).operate(stopped)


def _socket_path(team: str) -> Path | None:
    """Where programs of this user reach this operator; None if there is no place for it."""
    folder = make_runtime_dir()
    return None if folder is None else socket_path(folder, team, os.getpid())


class _Operator:
    """Sends references, and what drivers say."""

    def __init__(self, config: Config, bus: Bus, controls: DriveControls) -> None:
        # In lock-step none may be lost. In real time one that stands still and hears nothing any
        # more, as a frozen recorder, would hold up the router, and so everybody else.
        realtime = config.world.mode == "realtime"
        self._put = bus.publisher(REFERENCE.key(bus.team), waits=not realtime)
        self._bus, self._watch = bus, Liveness(bus, config)
        self._time = TeamTicks(bus, round(1000 * config.world.duration))
        controls.time = lambda: (self._time.tick, 1_000_000 * self._time.tick)
        self._controls = controls
        self._driven = DrivenReferences(config, controls) if controls.drivable else None
        self._at: Callable[[int], Reference] = partial(reference_at, config)
        self._ahead, self._look = _AHEAD, POLL
        if self._driven is not None:
            self._at, self._look = self._driven.at, LOOK
            self._ahead = _DRIVEN_AHEAD if realtime else _AHEAD

    def operate(self, stopped: Callable[[], bool]) -> None:
        """Publish the reference of each epoch that the team's time comes near to."""
        time, epoch = self._time, 0
        while not stopped():
            if EPOCH_MS * epoch <= time.tick + EPOCH_MS * self._ahead:
                self._put(encode(self._at(EPOCH_MS * epoch)))
                epoch += 1
                continue
            if self._watch.is_over(announced=time.over):
                return
            self._bus.declare(READY)
            self._follow()
            if self._driven is not None:
                self._driven.attend()
            else:
                self._controls.statuses()  # what nobody asks for must not be kept for ever

    def _follow(self) -> None:
        """Take in the team's time; see who is gone where there is none."""
        if self._time.follow(self._look):
            self._watch.receive()
        else:
            self._watch.poll(self._time.tick)


class TeamTicks:
    """The team's time, as whoever drives it tells it.

    Args:
        bus: subscribed to the clock and to events.
        last: tick of the end of the walk.

    Attributes:
        over: whether the end has been announced, and time has not gone on since.
    """

    def __init__(self, bus: Bus, last: int) -> None:
        self._bus, self._last = bus, last
        self._newest = -1  # tick of the clock
        self._end = 0  # tick that was announced
        self.over = False

    @property
    def tick(self) -> int:
        """As far as time has come."""
        return max(self._newest, 0)

    def follow(self, patience: float = POLL) -> bool:
        """Take in what has come; False if for `patience` seconds nothing has.

        A walk ends at the same tick for an operator who is behind: equal walks have equal
        references.
        """
        packet = self._bus.get(patience)
        if packet is None:
            return False
        for key, payload in (packet, *self._bus.drain()):
            try:
                if key == CLOCK.key(self._bus.team):
                    self._take_tick(decode(payload, Clock).tick)
                else:
                    self._take_event(decode(payload, Event))
            except MessageError:
                continue  # not for the operator to count: the recorder keeps it
        return True

    def _take_tick(self, tick: int) -> None:
        if self.over and tick <= self._end:
            return
        if self._newest < tick <= self._last:
            self._newest, self.over = tick, False

    def _take_event(self, event: Event) -> None:
        """The end, if the team can have come to its tick."""
        if event.kind == "stop" and event.tick <= min(self._last, self.tick + _GAP_MS):
            self._take_tick(event.tick - 1)
            self._end, self.over = event.tick, True
