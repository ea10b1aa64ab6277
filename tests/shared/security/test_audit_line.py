"""A refusal as a line of a router's log, and back."""

from __future__ import annotations

import pytest

from quadriga.shared.security.audit_line import AuditLine, format_refusal, parse_refusals

LINES = [
    AuditLine("r2.1", "put team/r1/command", "denied", 20),
    AuditLine("somebody", "connect: invalid peer certificate: BadSignature", "untrusted", 1),
    AuditLine("tcp/10.0.0.7:40122", "declare subscriber team/**", "denied", 3),
    AuditLine("probe.1", "put", "large", 1),
]


@pytest.mark.parametrize("line", LINES)
def test_what_is_written_is_read(line: AuditLine) -> None:
    assert list(parse_refusals([f"{format_refusal(line)}\n"])) == [line]


def test_other_lines_are_left_out_and_nobody_sends_escape_sequences_to_a_terminal() -> None:
    noise = ["routing at tls/0.0.0.0:7447", "refused: 3 more kinds", "refused: who: what (why)", ""]
    assert not list(parse_refusals(noise))
    wild = AuditLine("r2.1", "put team/\x1b[2J", "denied", 1)
    assert format_refusal(wild).isprintable()
