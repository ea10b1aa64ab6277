"""What came of an attack, from the recording, the router's log and what the attacker tells.

The log has all that the router has refused. Of what it tells the recorder some is missing where the
recorder could not keep up.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from quadriga.faults.security.attack import AttackReport, digest_of
from quadriga.shared.errors import MessageError
from quadriga.shared.members import PROBE
from quadriga.shared.recording.mcap_chunk import ChunkEntry
from quadriga.shared.security.audit_line import AuditLine
from quadriga.shared.security.roll import split_common_name
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.topics import find_topic


def describe_attack(
    entries: Iterable[ChunkEntry], audit: Iterable[AuditLine], report: AttackReport
) -> dict[str, int]:
    """Fields of a trial's row.

    `forged` is all that the attacker has tried: messages, and connections that nobody may make.
    `told` is how much of it the router has refused by its audit; what the router itself tries, to
    see that its rules are in force, is not counted. `refused` counts what reached a
    receiver and cannot be read, too. `passed` is what came through and can be read: of a message
    that is sent again all but the first.

    Args:
        entries: of the recording.
        audit: of the router's log.
        report: of the attacker.
    """
    told = sum(line.times for line in audit if split_common_name(line.who)[0] != PROBE)
    shots = {(shot.key, shot.digest): shot for shot in report.shots}
    keys = {shot.key for shot in report.shots}
    readable, unreadable = Counter[tuple[str, str]](), 0
    for entry in entries:
        if entry.key not in keys:
            continue
        at = entry.key, digest_of(entry.payload)
        if at not in shots:
            continue
        if _can_be_read(entry):
            readable[at] += 1
        else:
            unreadable += 1
    passed = sum(max(count - shots[at].heard, 0) for at, count in readable.items())
    refused = told + unreadable
    return {"forged": report.total, "refused": refused, "told": told, "passed": passed}


def _can_be_read(entry: ChunkEntry) -> bool:
    topic, _ = find_topic(entry.key)
    if topic is None:
        return True  # nobody reads it, but it came through
    try:
        decode(entry.payload, topic.type)
    except MessageError:
        return False
    return True
