"""What came of an attack: counted from a recording and from what the attacker tells."""

from __future__ import annotations

from quadriga.faults.security.attack import AttackReport, Shot, digest_of
from quadriga.faults.security.attack_outcome import describe_attack
from quadriga.shared.recording.mcap_chunk import ChunkEntry
from quadriga.shared.security.audit_line import AuditLine
from quadriga.shared.wire.codec import encode
from quadriga.shared.wire.messages import EStop

STOP = encode(EStop(5, 0, "forged"))
TRUE = encode(EStop(5, 0, "stop"))


def entry(key: str, payload: bytes) -> ChunkEntry:
    return ChunkEntry(key, 5, 0, payload)


def told(count: int, who: str = "r2.1") -> AuditLine:
    return AuditLine(who, "put team/estop", "denied", count)


def report(*shots: tuple[str, bytes, int, bool], connects: int = 0) -> AttackReport:
    made = [Shot(key, digest_of(load), count, heard) for key, load, count, heard in shots]
    return AttackReport(connects, tuple(made))


def test_what_the_router_has_told_is_refused_and_what_others_send_is_not_counted() -> None:
    audit = [told(15), told(5), told(4, "probe.1")]
    row = describe_attack(
        [entry("team/estop", TRUE)], audit, report(("team/estop", STOP, 20, False))
    )
    assert row == {"forged": 20, "refused": 20, "told": 20, "passed": 0}


def test_what_comes_through_has_passed_if_it_can_be_read() -> None:
    entries = [*[entry("team/estop", STOP)] * 2, entry("team/estop", b"")]
    shots = report(("team/estop", STOP, 19, False), ("team/estop", b"", 1, False))
    row = describe_attack(entries, [told(17)], shots)
    assert row == {"forged": 20, "refused": 18, "told": 17, "passed": 2}


def test_what_was_heard_before_has_passed_only_if_it_comes_again() -> None:
    once = [entry("team/estop", STOP)]
    shots = report(("team/estop", STOP, 1, True))
    assert describe_attack(once, [], shots)["passed"] == 0
    assert describe_attack(once * 2, [], shots)["passed"] == 1
    assert describe_attack([], [], shots)["passed"] == 0, "the clock is not recorded"


def test_a_foreign_key_that_comes_through_has_passed_and_connections_are_forged_too() -> None:
    shots = report(("team/of/strangers", b"\0", 1, False), connects=3)
    row = describe_attack([entry("team/of/strangers", b"\0")], [], shots)
    assert (row["forged"], row["refused"], row["passed"]) == (4, 0, 1)


def test_a_report_is_what_the_attacker_prints() -> None:
    text = '[3, [["team/estop", "ab", 20, false]]]'
    assert AttackReport.from_json(text) == AttackReport(3, (Shot("team/estop", "ab", 20, False),))
