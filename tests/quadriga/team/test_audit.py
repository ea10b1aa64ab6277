"""Senders whose messages a router refuses are named, however many keys another one uses."""

from __future__ import annotations

from collections import Counter

from quadriga.shared.security.refusals import DENIED, Refused
from quadriga.team.audit import condense


def put(who: str, key: str) -> Refused:
    return Refused(who, "put", key, DENIED)


def test_few_refusals_are_told_as_they_are() -> None:
    found = Counter({put("r2.1", f"team/{k}"): k for k in range(1, 21)})
    assert dict(condense(found)) == found


def test_who_hides_behind_the_many_keys_of_another_is_named() -> None:
    flood = {put("r2.1", f"team/{k}"): 3 for k in range(500)}
    hidden = {put("r3.1", "team/r1/command"): 1, put("r3.1", "team/r2/command"): 1}
    told = condense(Counter(flood | hidden))
    assert told[20:] == [(put("r2.1", "480 more keys"), 1440), (put("r3.1", "2 more keys"), 2)]
    assert sum(count for _, count in told) == 1502


def test_a_flood_of_senders_is_cut() -> None:
    found = Counter({put(f"stranger {k}", "team/estop"): 1 for k in range(5000)})
    assert len(condense(found)) == 40
