"""Is a recording what it should be? Every message is held against the rules it must keep to."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from quadriga.recordings.checks.delay import Delay
from quadriga.recordings.checks.ending import Ending
from quadriga.recordings.checks.finding import Check, CheckedMessage, Finding
from quadriga.recordings.checks.getting_up import GettingUp
from quadriga.recordings.checks.limits import Friction, Torques
from quadriga.recordings.checks.sequence import Ages, Gaps, Order
from quadriga.recordings.metadata import read_counts
from quadriga.recordings.readable import open_readable
from quadriga.shared.codec import decode
from quadriga.shared.errors import MessageError, RecordingError
from quadriga.shared.printable import printable_line
from quadriga.shared.recording.config import recorded_config
from quadriga.shared.recording.metadata import COUNTS
from quadriga.shared.recording.reader import ChunkEntry, Recording
from quadriga.shared.topics import Topic, find_topic
from quadriga.tables import align_columns

_WIDE = 96  # characters of a value that are shown


def check(path: Path) -> list[Finding]:
    """Hold a recording, or what is readable of it, against every rule.

    Raises:
        RecordingError: nothing of it can be read, or not with which configuration the team walked.
    """
    source, error = open_readable(path)
    config = recorded_config(source)
    filtered = "topics" in source.metadata or "exclude" in source.metadata
    schema = Finding("schema", "messages")
    getting_up = GettingUp()
    checks: tuple[Check, ...] = (
        Order(config),
        Gaps(config, getting_up, filtered=filtered),
        Delay(config, whole=error is None),
        Friction(config),
        Torques(config, getting_up),
        Ages(config, getting_up),
        Ending(source.notes),
    )
    times = Finding("log times", "messages")
    for item in _decode_valid(source.entries(), schema, times):
        getting_up.look(item)
        for each in checks:
            each.look(item)
    for each in checks:
        each.finish()
    whole = _check_whole(source, error, times.looked)
    return [whole, schema, times, *(each.finding for each in checks)]


def format_findings(findings: list[Finding]) -> list[str]:
    """One line for each check, and below it the first messages that break its rule."""
    rows = [("ok" if f.passed else "FAIL", f.name, f.text, "; ".join(f.notes)) for f in findings]
    lines = []
    for line, finding in zip(align_columns(rows, indent=""), findings, strict=True):
        lines.append(line)
        for first in finding.first:
            where = f"tick {first.tick} {first.key}: " if first.key else ""
            text = f"{where}got {first.got}, expected {first.limit}"
            lines.append(f"      {printable_line(text)}")
    return lines


def _decode_valid(
    entries: Iterator[ChunkEntry], schema: Finding, times: Finding
) -> Iterator[CheckedMessage]:
    """The valid messages; what breaks a rule goes to the findings `schema` and `times`."""
    rows: dict[str, tuple[Topic | None, str]] = {}
    foreign, newest = 0, dict[str, int]()  # log time by key: each sender has a clock of its own
    for key, tick, log_time, payload in entries:
        times.looked += 1
        if log_time < (last := newest.get(key, 0)):
            times.add_objection(
                tick, key, f"{(last - log_time) / 1e6:.3f} ms before", "a later log time"
            )
        newest[key] = log_time
        if key not in rows:
            rows[key] = find_topic(key)
        topic, robot = rows[key]
        if topic is None:
            foreign += 1
            continue
        schema.looked += 1
        try:
            message = decode(payload, topic.type)
        except MessageError as error:
            got = f"{error.name} {error.got}"
            schema.add_objection(tick, key, got[:_WIDE], error.expected[:_WIDE])
            continue
        yield CheckedMessage(key, robot, topic.name, message)
    if foreign:
        schema.notes.append(f"{foreign} of keys outside the table, not looked at")


def _check_whole(source: Recording, error: RecordingError | None, messages: int) -> Finding:
    """Whether the file is as it was written."""
    whole = Finding("whole", "messages", messages)
    notes = source.notes
    missing = max(read_counts(notes).get("messages", messages) - messages, 0)
    whole.looked += missing
    for damage in source.damages:
        whole.add_objection(-1, "", damage, "a readable file", 0)
    if error is not None:
        whole.add_objection(-1, "", error.got, error.expected, 0)
    if whole.first or missing:
        whole.objections = max(missing, 1)
        unknown = "" if COUNTS in notes else ", what came after them is not known"
        whole.count = f"{missing:,} of {whole.looked:,} messages missing{unknown}"
    return whole
