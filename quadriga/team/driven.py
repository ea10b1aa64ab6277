"""The references of a team that is driven by hand, and when it is told to stand and to go on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from quadriga.drive.controls import DriveControls, now_ms
from quadriga.drive.steering import GO_ON, STOP, LastWord, steer
from quadriga.drive.wish import Wish, approach, limits, standing
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Reference

LOOK: Final = 0.02  # s, between two looks at who drives
_SHARE: Final = 0.1  # of what may be asked for, the change in an epoch: all of it in a second


class DrivenReferences:
    """Follows whoever is in charge.

    Args:
        config: the team's configuration.
        controls: who that is, and what it asks for.
    """

    def __init__(self, config: Config, controls: DriveControls) -> None:
        self._controls = controls
        self._last = LastWord()
        self._rest = standing(config)
        self._wish: Wish = self._rest
        self._most: Mapping[str, float] = {
            name: _SHARE * (high - low) for name, (low, high) in limits().items()
        }

    def attend(self) -> None:
        """Look who drives; tell the team to stand, or to go on, if that has changed."""
        controls = self._controls
        now = now_ms()
        step = steer(self._last, controls.charge(), controls.statuses(), now)
        self._last, self._wish = step.last, step.wish or self._rest
        if step.word == STOP:
            controls.stand(step.reason)
        elif step.word == GO_ON:
            controls.go_on()

    def at(self, tick: int) -> Reference:
        """The reference of the next epoch, which begins at `tick`."""
        asked = approach(self._controls.asked, self._wish, self._most)
        self._controls.asked = asked
        return Reference(tick, tick * 1_000_000, asked.vx, asked.vy, asked.wz, asked.height)
