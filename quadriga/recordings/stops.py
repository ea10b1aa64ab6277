"""Why robots stopped that did not fall: as they say, and as the plant saw of who need not say."""

from __future__ import annotations

from typing import Final

from quadriga.recordings.traces import Traces
from quadriga.shared.wire.codes import BACK, GONE, SILENT, with_detail

_LOST: Final = (GONE, SILENT)


def find_stops(traces: Traces) -> dict[str, str]:
    """By process why it does not walk at the end: the reason in its last status.

    A controller of one's own need not say how it is. Where the plant's last word of it is that its
    commands no longer come, that is the reason.
    """
    last = {name: statuses[-1] for name, statuses in traces.statuses.items() if statuses}
    reasons = {name: status.reason for name, status in last.items() if status.reason}
    return _find_lost(traces) | reasons if traces.config.team.controller else reasons


def _find_lost(traces: Traces) -> dict[str, str]:
    """Robots without commands at the end, and what the plant announced of that."""
    lost = dict[str, str]()
    for event in traces.events:
        if event.code in _LOST and event.robot in traces.robots:
            lost[event.robot] = with_detail(event.code, event.detail)
        elif event.code == BACK:
            lost.pop(event.robot, None)
    return lost
