"""The recorder's loop from the bus to the files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Final

from quadriga.recorder.parts import Parts
from quadriga.recorder.selection import KeyFilter
from quadriga.recorder.starvation import Starvation
from quadriga.shared.bus.liveness import LAST_PACKETS, Loss, find_loss
from quadriga.shared.bus.session import Bus
from quadriga.shared.codec import decode
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.link.ticks import gathered
from quadriga.shared.members import PLANNER, plant_name
from quadriga.shared.messages import Event
from quadriga.shared.recording.reader import name_of
from quadriga.shared.recording.ticks import SkippedTicks
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.clock import log_ns, monotonic, sleep, wall_ns
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.topics import EVENT, TICKS, find_topic

FLUSH: Final = 0.05  # s wall between two flushes: a kill loses what has come since the last
QUIET: Final = 0.2  # s wall without a message after which nothing more is under way
DRAIN_LIMIT: Final = 5.0  # s wall, longest drain of a team that does not fall silent
_GATHER: Final = 0.02  # s wall, pause between looks at the inbox: one wake-up for many messages
_SLICE: Final = 500  # messages that are written at most before a look at the clock
_LOOK: Final = 1.0  # s wall after which a late recorder reports what it has
_TICKS: Final = f"/{TICKS.name}"
_NAMED: Final = 10  # robots of another team that are named; whoever publishes names them


class Session:
    """What is recorded of one team, from its first to its last message.

    Args:
        bus: the team's, subscribed to what is recorded.
        parts: the files.
        keys: which of the keys heard are recorded.
        config: the configuration that is stored.
        stopped: asked often whether to stop.
        say: called with what a user should know at once.
    """

    def __init__(
        self,
        bus: Bus,
        parts: Parts,
        keys: KeyFilter,
        config: Config,
        stopped: Callable[[], bool],
        say: Callable[[str], None],
    ) -> None:
        self._config, self._event_key = config, EVENT.key(bus.team)
        self._bus, self._parts, self._keys, self._stopped = bus, parts, keys, stopped
        self._say = say
        self._flushed = self._begun = monotonic()
        self._ended = self._seen = self._announced = self._drops = False
        self._hurries = config.world.mode == "lockstep"  # then it does from the start
        self._passed_over = SkippedTicks(config)
        self._missed_ns, self._robots = 0, frozenset(robot_names(config.team.robots))

    def record(self, *, late: bool, seen: bool) -> None:
        """Record until the end; a late recorder reports what it has once it knows.

        Args:
            late: nobody has waited for this recorder.
            seen: the plant has been there; its leaving is the end.
        """
        self._seen = seen
        self._say(f"recording team {self._bus.team!r} to {self._parts.paths[0]}")
        self._flushed = self._begun = monotonic()
        starvation = Starvation(self._begun)
        while not (self._stopped() or self._ended):
            self._take(max(0.0, self._flushed + FLUSH - monotonic()))
            if starvation.look(monotonic()):
                self._hurry()
            if late and monotonic() - self._begun > _LOOK and self._parts.messages:
                late = False
                self._report_missed()
            sleep(_GATHER)
        if late and self._parts.messages:
            self._report_missed()

    def _hurry(self) -> None:
        """Be scheduled like those that walk, who leave a recorder too little to keep up."""
        if not self._hurries and take_priority(self._config.runtime.priority):
            self._say(
                "this computer is too busy: the recorder takes the priority of those that walk"
            )
        self._hurries = True

    def _report_missed(self) -> None:
        first_ticks = self._parts.first_ticks()
        missed = _format_missed(first_ticks)
        if missed:
            self._say(missed)
        robots = {find_topic(key)[1] for key in first_ticks} - {""}
        known = robot_names(self._config.team.robots)
        strangers = robots - {*known, *map(plant_name, ("", *known)), PLANNER}
        if strangers:
            shown = sorted(strangers)[:_NAMED]
            more = f" and {len(strangers) - len(shown)} more" if len(strangers) > len(shown) else ""
            self._say(
                f"{', '.join(shown)}{more} walk too, but the configuration that is stored is "
                f"of {', '.join(known)}: give the team's with --config"
            )

    def drain(self) -> None:
        """Record what is still under way when the end is noticed.

        If who drives time is gone, its last words are waited for, which announce the end.
        """
        begun = monotonic()
        while monotonic() < begun + DRAIN_LIMIT:
            some = self._take(QUIET)
            if not some and (self.find_unannounced() is None or monotonic() > begun + LAST_PACKETS):
                break
        if self._bus.dropped:
            self._say(f"{self._bus.dropped:,} messages were dropped before they were recorded")

    def find_unannounced(self) -> Loss | None:
        """What has vanished without an announced end of the walk; None if nothing has."""
        return find_loss(self._bus, self._config) if self._seen and not self._announced else None

    @property
    def loss_ns(self) -> int:
        """When what has vanished was missed first, ns since 1970; 0: all is there."""
        return self._missed_ns

    def _take(self, timeout: float) -> bool:
        """Write all that has arrived; False if nothing came within `timeout` seconds."""
        first = self._bus.get(timeout)
        packets = () if first is None else (first, *self._bus.drain())
        now, recorded, write = log_ns(), self._keys, self._parts.write
        every = recorded.all
        for begin in range(0, len(packets), _SLICE):
            for key, payload in packets[begin : begin + _SLICE]:
                if key.endswith(_TICKS):
                    self._write_ticks(key, payload)
                    continue
                if every or recorded(key):
                    write(key, payload, now)
                if key == self._event_key:
                    self._note_event(payload)
                elif passed := self._passed_over.find(key, payload):
                    self._parts.skip(*passed)
            self._tend()
        self._tend()
        return bool(packets)

    def _write_ticks(self, key: str, payload: bytes) -> None:
        """Write each state and command of a batch under its own key.

        What an agent has gathered counts only where its plant was killed before it told the same.
        """
        robot, recorded = find_topic(key)[1], self._keys
        told = self._parts.ticks if robot in self._robots else {}
        items = gathered(key, payload)
        if told:
            items = [item for item in items if item.tick > told.get(item.key, -1)]
        self._parts.write_all([item for item in items if recorded(item.key)])

    def _note_event(self, payload: bytes) -> None:
        with suppress(MessageError):
            self._announced = self._announced or decode(payload, Event).kind == "stop"

    def _tend(self) -> None:
        """Flush when it is time to, and see whether the team is still there."""
        if monotonic() - self._flushed < FLUSH:
            return
        self._parts.flush()
        self._flushed = monotonic()
        if self._bus.dropped and not self._drops:
            self._drops = True
            self._say("this computer is too busy to record all: messages are dropped from now on")
        gone = find_loss(self._bus, self._config) is not None
        self._missed_ns = (self._missed_ns or wall_ns()) if gone else 0
        self._ended = self._seen and gone
        self._seen = self._seen or not gone


def _format_missed(first_ticks: Mapping[str, int]) -> str:
    """Since when a recording has each topic, in words; "" if it has them from the first tick on."""
    by_topic: dict[str, list[int]] = {}
    for key, tick in first_ticks.items():
        if tick >= 0:
            by_topic.setdefault(name_of(key) or "others", []).append(tick)
    if min(map(min, by_topic.values()), default=0) == 0:
        return ""
    words = []
    for name, ticks in sorted(by_topic.items(), key=lambda item: min(item[1])):
        spread = f"{min(ticks)} to {max(ticks)}" if max(ticks) > min(ticks) else f"{min(ticks)}"
        words.append(f"{name} since tick {spread}")
    return f"joined late, has {', '.join(words)}; what was before is missing"
