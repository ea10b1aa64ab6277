"""SHELL: what a recording is played with, in the side panel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Any, Final

import viser

from quadriga.playback.transport import Transport
from quadriga.view.recorded import Bookmark

_SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
_BEFORE_MS: Final = 500  # before what one jumps to: what led to it is to be seen
_NEAR_MS: Final = 20  # a mark so close to where one is has been reached

Wish = Callable[[Transport, float], None]


class Controls:
    """Play, pause, speed, a slider of time, and buttons that jump to what happened.

    Whoever clicks is in another thread, so wishes wait until the loop fulfils them.

    Args:
        server: where.
        folder: of the panel, that holds them.
        ends: the first and the last tick, ms.
        marks: what happened, by time.
        step_ms: of the buttons for a single step.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        folder: Any,
        ends: tuple[int, int],
        marks: Sequence[Bookmark],
        step_ms: int,
    ) -> None:
        self._wishes: SimpleQueue[Wish] = SimpleQueue()
        self._ends, self._marks = ends, marks
        first, last = (1e-3 * tick for tick in ends)
        with folder:
            self._play = server.gui.add_button("pause")
            self._slider: Any = server.gui.add_slider("time [s]", first, last, 0.01, first)
            steps = server.gui.add_button_group("step", ("−", "+"), hint=f"{step_ms} ms")
            speed = server.gui.add_dropdown(
                "speed", tuple(f"{value:g} ×" for value in _SPEEDS), initial_value="1 ×"
            )
            jumps = server.gui.add_button_group("event", ("previous", "next"))
            choice = server.gui.add_dropdown("go to", tuple(map(_describe, marks)) or (_NOTHING,))
        self._play.on_click(lambda _: self._wishes.put(self._toggle))
        self._slider.on_update(self._take_slider)
        sign = {"−": -1, "+": 1}
        steps.on_click(lambda event: self._wish_step(sign[event.target.value] * step_ms))
        speed.on_update(lambda event: self._wish_rate(float(event.target.value.split()[0])))
        jumps.on_click(lambda event: self._wishes.put(self._jumps[event.target.value]))
        choice.on_update(lambda event: self._wish_mark(event.target.value))
        self._jumps: dict[str, Wish] = {"previous": self._go_back, "next": self._go_on}

    def fulfil(self, transport: Transport, now: float) -> None:
        """Do what was clicked since this was called last; at the end of the recording, pause."""
        for _ in range(self._wishes.qsize()):
            self._wishes.get_nowait()(transport, now)
        if not transport.paused and transport.position(now) >= self._ends[1]:
            transport.seek(self._ends[1], now)
            transport.toggle(now)

    def show(self, transport: Transport, now: float) -> None:
        """Show where the playback is."""
        self._play.label = "play" if transport.paused else "pause"
        self._slider.value = round(1e-3 * min(transport.position(now), self._ends[1]), 2)

    def _toggle(self, transport: Transport, now: float) -> None:
        if transport.paused and transport.position(now) >= self._ends[1]:
            transport.seek(self._ends[0], now)
        transport.toggle(now)

    def _take_slider(self, event: Any) -> None:
        if event.client_id is not None:  # not this program, which moves it too
            self._wish_seek(1000.0 * event.target.value)

    def _wish_seek(self, tick: float) -> None:
        low, high = self._ends
        self._wishes.put(lambda transport, now: transport.seek(min(max(tick, low), high), now))

    def _wish_step(self, ms: int) -> None:
        def step(transport: Transport, now: float) -> None:
            transport.step(ms, now)
            low, high = self._ends
            transport.seek(min(max(transport.position(now), low), high), now)

        self._wishes.put(step)

    def _wish_rate(self, rate: float) -> None:
        def change(transport: Transport, now: float) -> None:
            transport.seek(transport.position(now), now)
            transport.rate = rate

        self._wishes.put(change)

    def _wish_mark(self, text: str) -> None:
        for mark in self._marks:
            if _describe(mark) == text:
                self._wish_seek(mark.tick - _BEFORE_MS)

    def _go_on(self, transport: Transport, now: float) -> None:
        here = transport.position(now) + _BEFORE_MS
        later = [mark.tick for mark in self._marks if mark.tick > here + _NEAR_MS]
        self._wish_seek(min(later, default=self._ends[1] + _BEFORE_MS) - _BEFORE_MS)

    def _go_back(self, transport: Transport, now: float) -> None:
        here = transport.position(now) + _BEFORE_MS
        earlier = [mark.tick for mark in self._marks if mark.tick < here - _NEAR_MS]
        self._wish_seek(max(earlier, default=self._ends[0] + _BEFORE_MS) - _BEFORE_MS)


_NOTHING: Final = "nothing happened"


def _describe(mark: Bookmark) -> str:
    return f"{mark.tick / 1000:.2f} s {mark.text}"
