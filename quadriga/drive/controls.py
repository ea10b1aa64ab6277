"""SHELL of the controls: what drivers say reaches the team, whoever of them says it and how.

Drivers are heard by threads of their own, so that a stop waits for nothing that the operator does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from threading import Lock
from typing import Final

from quadriga.drive import charge as charging
from quadriga.drive import driver_words as words
from quadriga.drive.charge import InCharge
from quadriga.drive.driver_words import DriverWord
from quadriga.drive.wish import standing
from quadriga.shared.bus.session import Arrival, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.messages import EStop, Event, Message, Reset, Resume, SafeStop, Status
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.shared.topics import ESTOP, EVENT, RESET, RESUME, STATUS, STOP, Topic

_MOVES: Final = frozenset((words.GO_ON, words.RESET))  # has robots get up, or walk
_MOST_EVENTS: Final = 1000  # since the last emergency stop; more can only be a flood


class DriveControls:
    """Who drives, what the team says of itself, and the words that drivers may say to it.

    Safe to be used by several threads.

    Args:
        config: the team's configuration.
        bus: of the operator.
        drivable: whether the team is driven by hand; else nobody can take the controls, while all
            other words are obeyed.

    Attributes:
        time: gives tick and stamp of the team's time, for what is said.
        asked: what is asked of the team at present.
    """

    def __init__(self, config: Config, bus: Bus, *, drivable: bool) -> None:
        team = config.team.name
        self.drivable = drivable
        self.robots = robot_names(config.team.robots)
        self.plant_each = config.team.plant_per_robot
        self.time: Callable[[], tuple[int, int]] = lambda: (0, 0)
        self.asked = standing(config)
        self._lock = Lock()
        self._charge = InCharge()
        self._statuses: dict[str, Status] = {}
        self._events: list[Event] = []
        self._take_status = {name: bus.collect(STATUS.key(team, name)) for name in self.robots}
        self._take_event = bus.collect(EVENT.key(team))
        self._put = {
            topic: bus.publisher(topic.key(team), urgent=True)
            for topic in (ESTOP, STOP, RESET, RESUME)
        }

    def leave(self, driver: str) -> None:
        """Note that a driver is gone."""
        with self._lock:
            self._charge = charging.leave(self._charge, driver)

    def charge(self) -> InCharge:
        """Who is in charge now."""
        with self._lock:
            self._charge = charging.lapse(self._charge, now_ms())
            return self._charge

    def statuses(self) -> Mapping[str, Status]:
        """The newest status of each robot that has spoken."""
        self._take_in()
        return dict(self._statuses)

    def events(self) -> tuple[Event, ...]:
        """What the plants have announced since the last emergency stop."""
        self._take_in()
        return tuple(self._events)

    def hear(self, driver: str, said: DriverWord) -> None:
        """Do what a driver says; stops of anybody, what moves robots of nobody but who drives."""
        with self._lock:
            self._charge = self._step(driver, said, now_ms())
            if said.kind in _MOVES and self._charge.driver not in ("", driver):
                return
        if said.kind == words.ESTOP:
            with self._lock:
                self._events.clear()
                self._statuses.clear()
            self.say(ESTOP, EStop(*self.time(), said.text or driver))
        elif said.kind == words.STAND:
            self.stand(said.text or driver)
        elif said.kind == words.GO_ON:
            self.go_on()
        elif said.kind == words.RESET and said.text:
            self.say(RESET, Reset(*self.time(), said.text))

    def stand(self, reason: str) -> None:
        """Have all robots slow down and stand."""
        self.say(STOP, SafeStop(*self.time(), reason, False))

    def go_on(self) -> None:
        """Have robots walk that stand and may go on."""
        self.say(RESUME, Resume(*self.time()))

    def say(self, topic: Topic, message: Message) -> None:
        """Say a word to the team, before whatever waits to be sent."""
        self._put[topic](encode(message))

    def _step(self, driver: str, said: DriverWord, now: int) -> InCharge:
        charge = charging.lapse(self._charge, now)
        if said.kind == words.TAKE and self.drivable:
            return charging.take(charge, driver, now)
        if said.kind == words.RELEASE:
            return charging.release(charge, driver)
        if said.kind == words.DRIVE and said.wish is not None:
            return charging.hear(charge, driver, said.wish, now, held=said.held)
        return charge

    def _take_in(self) -> None:
        with self._lock:
            for name, take in self._take_status.items():
                status = _last(take(), Status)
                if status is not None:
                    self._statuses[name] = status
            for _, _, payload in self._take_event():
                with suppress(MessageError):
                    if len(self._events) < _MOST_EVENTS:
                        self._events.append(decode(payload, Event))


def now_ms() -> int:
    """Milliseconds of a steady clock."""
    return monotonic_ns() // 1_000_000


def _last(arrivals: list[Arrival], kind: type[Status]) -> Status | None:
    """The newest of what has arrived that can be read."""
    for _, _, payload in reversed(arrivals):
        with suppress(MessageError):
            return decode(payload, kind)
    return None
