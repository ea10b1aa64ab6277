"""What a fault makes of a component's numbers, tick by tick."""

from __future__ import annotations

from collections import deque

import numpy as np

from quadriga.shared.robot.conventions import Array
from quadriga.sim_server.world.faults.components import Component
from quadriga.sim_server.world.faults.fault import (
    DELAYED,
    GARBAGE,
    INTERMITTENT,
    OFF,
    SLOW,
    SPAN_MS,
    STUCK,
    WRONG,
    ComponentFault,
)


class Distortion:
    """One fault at one component; its memory is what the component said before.

    Args:
        fault: what is wrong, and when.
        component: whose numbers it changes.
        random: its own source of chance.

    Attributes:
        component: as given.
    """

    def __init__(
        self, fault: ComponentFault, component: Component, random: np.random.Generator
    ) -> None:
        self.component = component
        self._fault, self._random = fault, random
        self._sound = deque[Array](maxlen=SPAN_MS + 1)  # the newest sound numbers
        self._held: Array | None = None
        self._off = False

    def distort(self, tick: int, values: Array) -> Array:
        """The component's numbers at a tick, of the sound ones.

        Args:
            tick: one more than at the last call.
            values: sound numbers, in the order of the component's columns.
        """
        fault = self._fault
        if not fault.holds(tick):
            self._sound.append(values)
            return values
        before = self._sound[-1] if self._sound else values
        if fault.kind == DELAYED:
            self._sound.append(values)
            return self._sound[0]
        begins_span = (tick - fault.start) % SPAN_MS == 0
        if begins_span:
            self._held = values
            self._off = bool(self._random.random() < 0.5)
        return self._spoil(values, before)

    def _spoil(self, values: Array, before: Array) -> Array:
        kind, component = self._fault.kind, self.component
        if kind == OFF or (kind == INTERMITTENT and self._off):
            return np.zeros_like(values)
        if kind == STUCK:
            return before
        if kind == GARBAGE:
            drawn = self._random.uniform(component.low, component.high)
            return drawn / np.linalg.norm(drawn) if component.unit_length else drawn
        if kind == WRONG:
            return component.wrong(values)
        if kind == SLOW and self._held is not None:
            return self._held
        return values
