"""What drivers are told, as JSON: who drives, what the robots do, and what came of a stop."""

from __future__ import annotations

import json
from typing import Any, Final

from quadriga.drive.charge import why_stand
from quadriga.drive.controls import DriveControls, now_ms
from quadriga.drive.driver_words import NEWS
from quadriga.drive.stop_proof import unconfirmed
from quadriga.drive.wish import NAMES, limits
from quadriga.shared.messages import Status

_PATIENCE_MS: Final = 500  # in which all must have stopped


def tell_news(driver: str, controls: DriveControls) -> str:
    """The news for one driver."""
    charge, statuses = controls.charge(), controls.statuses()
    robots = {name: _describe(statuses.get(name)) for name in controls.robots}
    body: dict[str, Any] = {
        "kind": NEWS,
        "you": driver,
        "driver": charge.driver,
        "drivable": controls.drivable,
        "stands": why_stand(charge),
        "robots": robots,
        "asked": {name: getattr(controls.asked, name) for name in NAMES},
        "limits": limits(),
    }
    return json.dumps(body)


def _describe(status: Status | None) -> dict[str, Any]:
    if status is None:
        return {"mode": "", "reason": "says nothing", "tick": 0}
    return {"mode": status.mode, "reason": status.reason, "tick": status.tick}


class Stopping:
    """An emergency stop that has been sent, until all have said that they have stopped.

    Args:
        controls: through which it was sent.
    """

    def __init__(self, controls: DriveControls) -> None:
        self._controls = controls
        self._begun = now_ms()
        self._missing: list[str] = []

    def is_over(self) -> bool:
        """Whether all have stopped, or it has taken too long."""
        c = self._controls
        self._missing = unconfirmed(c.robots, c.statuses(), c.events(), plant_each=c.plant_each)
        return not self._missing or now_ms() - self._begun > _PATIENCE_MS

    def tell(self, number: int) -> str:
        """What came of it, for the driver whose count was `number`."""
        ms = now_ms() - self._begun
        return json.dumps({"kind": "stopped", "number": number, "ms": ms, "missing": self._missing})
