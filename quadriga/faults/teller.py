"""SHELL: tells the recording which fault is made, and when it is over; the team does not listen."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Event as Flag
from threading import Thread
from typing import Final

from quadriga.faults.fault import Stage
from quadriga.shared import codes
from quadriga.shared.bus.session import HERE, Bus
from quadriga.shared.codec import decode, encode
from quadriga.shared.errors import MessageError
from quadriga.shared.members import RECORDER
from quadriga.shared.messages import Clock, Event
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import CLOCK, INJECTED, RECEIVED

# World time from the word to the fault, ms: by then it is on the disk, whoever is killed. It is
# said before, so that nothing is sent between the reading of the clock and the fault itself.
LEAD_MS: Final = 1000
_PATIENCE_S: Final = 10.0  # for a recorder that is started again to answer
_ASK_S: Final = 0.5
_CLOCK_S: Final = 1.0  # for the team's clock to be heard
_OPENS_S: Final = 1.0  # from its first answer until it hears all
_LOOK_S: Final = 0.02


class FaultTeller:
    """The events of one fault, in the name of the launcher that makes it.

    Args:
        bus: the launcher's.
        name: of the fault, as in the table.
        stage: of its walk.

    Attributes:
        tick: the newest that the team's clock has shown, ms; 0: it has shown none.
    """

    def __init__(self, bus: Bus, name: str, stage: Stage) -> None:
        self.tick = 0
        self._bus, self._name, self._stage = bus, name, stage
        bus.subscribe(CLOCK.key(bus.team))
        self._put = bus.publisher(INJECTED.key(bus.team), urgent=True)

    def read_clock(self) -> int:
        """The newest tick of the team's clock, ms."""
        for key, payload in self._bus.drain():
            if key == CLOCK.key(self._bus.team):
                with suppress(MessageError):
                    self.tick = max(self.tick, decode(payload, Clock).tick)
        return self.tick

    def tell_begin(self, tick: int) -> None:
        """Tell that the fault comes at a tick, ms, which may be a little ahead."""
        detail = self._stage.detail
        self._tell(tick, codes.FAULT_BEGINS, f"{self._name}: {detail}" if detail else self._name)

    @contextmanager
    def telling_end(self, struck: float) -> Iterator[None]:
        """While a fault goes on and the team is looked at, tell when it is over, if ever.

        Args:
            struck: when the strike has returned, by `monotonic`, s.
        """
        lasts = self._stage.lasts
        if lasts is None:
            yield
            return
        left = Flag()
        thread = Thread(target=self._tell_end, args=(struck + lasts, left), daemon=True)
        thread.start()
        try:
            yield
        finally:
            left.set()
            thread.join()

    def _tell_end(self, at: float, left: Flag) -> None:
        if left.wait(max(0.0, at - monotonic())):
            return  # the walk is over before
        over, shown = monotonic(), self.read_clock()
        self._await_recorder(left)
        self._tell(self._tick_at(over, shown, left), codes.FAULT_ENDS, f"{self._name} is over")

    def _tick_at(self, moment: float, shown: int, left: Flag) -> int:
        """World time at a moment, ms: where no clock was heard then, by that of this computer.

        Args:
            moment: by `monotonic`, s.
            shown: what the team's clock had shown last, ms.
            left: set once the walk is over.
        """
        deadline = monotonic() + _CLOCK_S
        while self.read_clock() == shown and monotonic() < deadline and not left.is_set():
            left.wait(_LOOK_S)
        return max(shown, self.tick - round(1000 * (monotonic() - moment)))

    def _await_recorder(self, left: Flag) -> None:
        """Wait until the recorder hears; not for ever, as a busy one hears without a word."""
        deadline = monotonic() + _PATIENCE_S
        while monotonic() < deadline and not left.is_set():
            if RECORDER in self._bus.members_at(HERE):  # seen behind what it listens to
                return
            # One that has come later is no member of the team, and answers before it hears all.
            answers = self._bus.ask(f"{self._bus.team}/{RECORDER}/{RECEIVED}", _ASK_S)
            while not answers.over:
                left.wait(_LOOK_S)
            if answers.came:
                left.wait(_OPENS_S)
                return
            left.wait(_LOOK_S)

    def _tell(self, tick: int, code: str, detail: str) -> None:
        self._put(encode(Event.of(tick, code, self._stage.robot, detail)))
