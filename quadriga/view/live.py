"""SHELL of `quadriga view`: a running team in the browser. It listens, and never says a word."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.link.ticks import LinkMessage, gathered
from quadriga.shared.messages import Event, State
from quadriga.shared.runtime.clock import Rate, monotonic
from quadriga.shared.topics import (
    AGENT_EVENT,
    COMMAND,
    EVENT,
    INJECTED,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    STATE,
    STATUS,
    TICKS,
    TRUTH,
)
from quadriga.view.gather import Gatherer
from quadriga.view.port import PageAddress, url_of
from quadriga.view.stage import FRAME_S, TeamStage
from quadriga.view.team_shape import TeamShape, build_team_shape
from quadriga.view.traffic import Traffic
from quadriga.view.viser_server import open_server

_EVENTS: Final = 20  # that are remembered
_QUIET_S: Final = 2.0  # without a message after which the heading says so
_REPORT_S: Final = 1.0  # between two reports of the traffic
_UNSEEN_S: Final = 0.15  # between two looks while nobody has the page open
_POLITE: Final = 10  # added to the nice value: a team on the same machine comes first


class _Feed:
    """What a team sends, taken in whenever somebody asks.

    Attributes:
        gatherer: has the newest of all.
        traffic: counts.
        happenings: what was announced, by tick and text, the newest last.
    """

    def __init__(self, bus: Bus, shape: TeamShape, now: float) -> None:
        self.gatherer, self.traffic = Gatherer(shape), Traffic(now)
        self.happenings: list[tuple[int, str]] = []
        per_robot = (MEASUREMENT, PLAN, STATUS, AGENT_EVENT)
        wanted = [(topic, "") for topic in (TRUTH, REFERENCE, EVENT, INJECTED)]
        wanted += [(topic, robot) for robot in shape.robots for topic in per_robot]
        self._topics = {topic.key(bus.team, robot): (topic, robot) for topic, robot in wanted}
        told = [topic.key(bus.team, r) for topic in (STATE, COMMAND) for r in shape.robots]
        for key in (*told, *self._topics):
            self.traffic.note(_short(key), 0, -1, now)
        self._take = bus.collect(*self._topics, TICKS.key(bus.team, "*"))

    def read(self, now: float) -> bool:
        """Take in what has come; whether anything has."""
        arrived = self._take()
        for _, key, payload in arrived:
            known = self._topics.get(key)
            if known is None:
                self._take_ticks(key, payload, now)
                continue
            topic, robot = known
            try:
                message = decode(payload, topic.type)
            except MessageError:
                continue  # the recorder keeps it
            self.traffic.note(_short(key), 1, message.tick, now)
            if isinstance(message, Event):
                text = " ".join((message.kind, message.robot, message.detail))
                self.happenings = [*self.happenings[1 - _EVENTS :], (message.tick, text)]
            else:
                self.gatherer.take(message, robot)
        return bool(arrived)

    def _take_ticks(self, key: str, payload: bytes, now: float) -> None:
        newest = dict[str, LinkMessage]()
        for item in gathered(key, payload):
            self.traffic.note(_short(item.key), 1, item.tick, now)
            if item.topic is STATE:
                newest[item.robot] = item
        for robot, item in newest.items():
            with suppress(MessageError):  # of a sensor that says what is no number
                self.gatherer.take(decode(item.payload, State), robot)


def _short(key: str) -> str:
    """A key without the team."""
    return key.partition("/")[2]


def view_live(
    config: Config,
    address: PageAddress,
    stopped: Callable[[], bool],
    say: Callable[[str], None],
    *,
    once: bool = False,
) -> None:
    """Show a team until this is stopped.

    Args:
        config: the team's configuration.
        address: of the web server.
        stopped: whether to stop.
        say: tells the user where to look.
        once: whether to leave when a team that was there has left.

    Raises:
        ConfigError: the port is in use, or what it takes to draw the robots is missing.
        BusError: the bus cannot be opened.
    """
    team = config.team.name
    with open_server(address, f"quadriga · {team}") as server:
        os.nice(_POLITE)
        stage = TeamStage(server, build_team_shape(config))
        url = url_of(server.get_port(), address.host)
        say(f"team {team!r} at {config.bus.endpoint} in the browser: {url}")
        with Bus.open(config.bus, team, f"view-{os.getpid()}", stopped) as bus:
            over = _leaves_with(bus) if once else lambda: False
            _show(bus, stage, lambda: stopped() or over())


def _leaves_with(bus: Bus) -> Callable[[], bool]:
    """A function that tells whether a team that was there has left."""
    was_there = False

    def has_left() -> bool:
        nonlocal was_there
        there = bool(bus.members_at(HERE))
        was_there |= there
        return was_there and not there

    return has_left


def _show(bus: Bus, stage: TeamStage, stopped: Callable[[], bool]) -> None:
    rate, begun = Rate(FRAME_S), monotonic()
    feed, pace = _Feed(bus, stage.shape, begun), _Pace(begun)
    due = begun
    while not stopped():
        rate.wait()
        now, has_audience = monotonic(), stage.has_audience
        if not has_audience and now < due:
            continue
        due = now + _UNSEEN_S
        pace.note(feed.read(now), feed.gatherer.tick, now)
        if not has_audience:
            continue
        state = pace.describe(now) or _describe_silence(bus)
        if stage.show(feed.gatherer.snapshot(), state, now):
            stage.panels.show_happenings(feed.happenings)
        if pace.is_report_due(now):
            stage.panels.show_traffic(feed.traffic.report(now))


def _describe_silence(bus: Bus) -> str:
    there = ", ".join(sorted(bus.members_at(HERE)))
    return f"nothing is heard; here are {there}" if there else "nobody is heard yet"


class _Pace:
    """How fast the team's time passes, and whether it passes at all."""

    def __init__(self, now: float) -> None:
        self._heard, self._since, self._tick, self._newest = now - _QUIET_S, now, 0, 0
        self._speed = ""

    def note(self, any_came: bool, tick: int, now: float) -> None:
        """Whether anything has come, and the newest tick by now, ms."""
        if any_came:
            self._heard = now
        self._newest = tick

    def describe(self, now: float) -> str:
        """What the heading says; empty if nothing is heard."""
        return "" if now - self._heard > _QUIET_S else f"live{self._speed}"

    def is_report_due(self, now: float) -> bool:
        """Whether a second has passed since this was true last; the speed is renewed then."""
        if now - self._since < _REPORT_S:
            return False
        passed = 1e-3 * (self._newest - self._tick) / (now - self._since)
        self._speed = f", {passed:.2f} × real time" if passed > 0.0 else ""
        self._since, self._tick = now, self._newest
        return True
