"""Why robots stopped that did not fall: as they say, and as the end of the walk says."""

from __future__ import annotations

import re

from quadriga.recordings.traces import Traces
from quadriga.shared.codes import COMMAND_LOST, with_detail
from quadriga.shared.topics import COMMAND, STATE


def find_stops(traces: Traces) -> dict[str, str]:
    """By process why it does not walk at the end: the reason in its last status.

    A process may be frozen, and a controller of one's own need not say how it is. Where the walk
    ended since a robot's commands did not come any more, or none ever came, that is the reason.
    """
    last = {name: statuses[-1] for name, statuses in traces.statuses.items() if statuses}
    reasons = {name: status.reason for name, status in last.items() if status.reason}
    return _find_lost(traces) | reasons


def _find_lost(traces: Traces) -> dict[str, str]:
    """Robots without commands at the end, and what the plant announced of that."""
    team, count, lost = traces.config.team.name, traces.messages.get, dict[str, str]()
    for name in traces.robots:
        if count(STATE.key(team, name)) and not count(COMMAND.key(team, name)):
            lost[name] = with_detail(COMMAND_LOST, "it has never sent a command")
    for event in traces.events:
        if event.code == COMMAND_LOST:
            said = event.detail.partition(";")[0]  # what follows tells how late the others were
            named = set(re.split(r"[, ]+", said)).intersection(traces.robots)
            lost |= dict.fromkeys(named, with_detail(event.code, said))
    return lost
