"""The plant on the bus: what lock-step and real time share."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Final, NamedTuple

from quadriga.plant.commands import CommandBox
from quadriga.plant.protocol import Plant
from quadriga.shared.bus.zenoh_bus import Bus
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import periods
from quadriga.shared.members import SIM
from quadriga.shared.wire import codes
from quadriga.shared.wire.codec import encode, truncate_text
from quadriga.shared.wire.messages import Command, Event, Status
from quadriga.shared.wire.topics import EVENT, STATE, STATUS, TRUTH

FALL_LINGER_MS: Final = 1000  # world time that is still shown after the first fall


class End(NamedTuple):
    """Why a walk is over: a code of `quadriga.shared.wire.codes.EVENTS`, and prose."""

    code: str
    detail: str


TOLD_TO_STOP: Final = End(codes.SIGNAL, "signal")


class PlantServer:
    """The plant, its publishers, the commands that arrive, and when the walk is over.

    Attributes:
        commands: the newest command of every robot.
        silent: robots that are not waited for.
    """

    def __init__(self, config: Config, plant: Plant, bus: Bus) -> None:
        team, realtime = config.team.name, config.world.mode == "realtime"
        self.config, self.plant, self.bus = config, plant, bus
        self.commands = CommandBox(team, plant.names)
        self.silent: set[str] = set()
        self._put_state = {
            name: bus.publisher(STATE.key(team, name), droppable=realtime) for name in plant.names
        }
        # A robot that no longer reads must not hold up the others once its buffers are full.
        self._put_silent = {
            name: bus.publisher(STATE.key(team, name), droppable=True) for name in plant.names
        }
        self._put_truth = bus.publisher(TRUTH.key(team), droppable=realtime)
        self._put_status = bus.publisher(STATUS.key(team, SIM), droppable=True)
        self._put_event = bus.publisher(EVENT.key(team), droppable=realtime)
        self._put_stop = bus.publisher(EVENT.key(team))  # all leave by it, no tick waits for it
        self._truth_period = periods(config)[TRUTH.name]
        self._last_tick = round(config.world.seconds * 1000)
        self._fallen: set[str] = set()
        self._malformed = 0

    def publish(self) -> None:
        """Send the present tick's truth, when due, and every robot's state."""
        plant = self.plant
        if plant.tick % self._truth_period == 0 and (truth := plant.truth()) is not None:
            self._put_truth(encode(truth))
        for name, state in plant.states().items():
            put = self._put_silent if name in self.silent else self._put_state
            put[name](encode(state))
        plant.settle()

    def announce(self, code: str, robot: str, detail: str) -> None:
        """Publish an event of the present tick; a detail longer than a message's text is cut."""
        self._send(Event.of(self.plant.tick, code, robot, truncate_text(detail)))

    def publish_status(self, status: Status) -> None:
        """Publish the plant's report on itself."""
        self._put_status(encode(status))

    def step(self, commands: Mapping[str, Command]) -> End | None:
        """Advance the plant by one tick; why the walk ends, if it does."""
        self._report_malformed()
        for event in self.plant.step(commands):
            self._send(event)
            if event.code == codes.FALL:
                self._fallen.add(event.robot)
                self._last_tick = min(self._last_tick, event.tick + FALL_LINGER_MS)
        if self.plant.tick < self._last_tick:
            return None
        self._report_malformed(at_once=True)
        fallen = [name for name in self.plant.names if name in self._fallen]
        if fallen:
            return End(codes.FALLEN, f"fall of {', '.join(fallen)}")
        return End(codes.TIME_OVER, "end of world.seconds")

    def _report_malformed(self, *, at_once: bool = False) -> None:
        """Announce malformed commands, once in a second of world time at most unless `at_once`."""
        count = self.commands.malformed
        if count != self._malformed and (at_once or self.plant.tick % 1000 == 0):
            self._malformed = count
            detail = f"{count} commands dropped: {self.commands.last_error}"
            self.announce(codes.MALFORMED, "", detail)

    def _send(self, event: Event) -> None:
        put = self._put_stop if event.kind == "stop" else self._put_event
        put(encode(event))
        print(
            f"{event.tick} ms: {event.kind} {event.robot} {event.detail}",
            file=sys.stderr,
            flush=True,
        )
