"""A router's refusals as the reason why a process is not there."""

from __future__ import annotations

import pytest

from quadriga.shared.bus.absence import describe_absent, diagnose, diagnose_nameless
from quadriga.shared.bus.diagnosis import BAD, GOOD, NOTE
from quadriga.shared.bus.distrust import diagnose_refusals
from quadriga.shared.members import team_members
from quadriga.shared.security.past_refusals import PastRefusal
from quadriga.shared.security.refusals import Refused
from tests.shared.bus.abouts import SIM, about, view

R2 = next(m for m in team_members(("r1", "r2"), central=False, recorded=False) if m.name == "r2")


def past(
    reason: str, key: str = "", age: float = 1.0, who: str = "r2.1", count: int = 3
) -> PastRefusal:
    return PastRefusal(Refused(who, "put", key, reason), count, age)


@pytest.mark.parametrize(
    ("reason", "code", "words"),
    [
        ("revoked", "revoked", "its certificate r2.1 is revoked (3 times, last 1 s ago)"),
        ("expired", "expired", "its certificate r2.1 has expired, and its link was closed"),
        ("full", "full", "the router had no session left for r2.1"),
        ("denied", "denied", "denied put team/r1/plan (3 times, last 1 s ago)"),
        ("large", "limited", "too much: put team/r1/plan"),
    ],
)
def test_each_reason_has_a_code(reason: str, code: str, words: str) -> None:
    (found,) = diagnose_refusals("r2", [past(reason, "team/r1/plan")], here=False)
    assert found.code == code
    assert found.text.startswith(words)
    assert found.verdict == (NOTE if code == "limited" else BAD)
    assert found.remedy
    assert not list(diagnose_refusals("r1", [past(reason)], here=False))


def test_of_one_who_is_there_only_what_is_recent_is_wrong() -> None:
    verdicts = [
        next(diagnose_refusals("r2", [past("denied", age=age)], here=here)).verdict
        for here, age in ((True, 1.0), (True, 60.0), (False, 60.0))
    ]
    assert verdicts == [BAD, NOTE, BAD]


def test_of_many_keys_the_newest_are_named() -> None:
    many = [past("denied", f"k{k}") for k in range(5)]
    (found,) = diagnose_refusals("r2", many, here=False)
    assert found.text.startswith("denied put k2, put k3, put k4 and 2 more (")


def test_revoked_is_reason_enough_and_denied_is_not() -> None:
    gone = view(SIM, about("r1", sees=("sim",)), here=frozenset({"sim", "r1"}))
    for reason, codes in (("revoked", ["revoked"]), ("denied", ["denied", "not-reachable"])):
        seen = view(SIM, about("r1"), here=gone.here, refused=(past(reason),))
        assert [item.code for item in diagnose(R2, seen)] == codes
    back = view(SIM, about("r1"), about("r2"), refused=(past("revoked", age=99.0),))
    assert [(i.code, i.verdict) for i in diagnose(R2, back)] == [("ready", GOOD), ("revoked", NOTE)]


def test_who_has_no_name_is_a_stranger_once_all_are_there() -> None:
    knock = PastRefusal(Refused("somebody", "connect: no certificate", "", "untrusted"), 1, 2.0)
    (alone,) = diagnose_nameless(view(SIM, about("r1"), refused=(knock,)))
    assert (alone.code, alone.verdict) == ("not-trusted", BAD)
    assert alone.text == "the router has not let in somebody: no certificate (once 2 s ago)"
    (all_there,) = diagnose_nameless(view(SIM, about("r1"), about("r2"), refused=(knock,)))
    assert all_there.verdict == NOTE
    assert describe_absent([R2], view(SIM, about("r1"), refused=(knock,))).endswith(alone.text)


def test_a_router_that_says_nothing_is_told() -> None:
    (found,) = diagnose_nameless(view(SIM, refused=None))
    assert (found.code, found.verdict) == ("router-silent", BAD)
