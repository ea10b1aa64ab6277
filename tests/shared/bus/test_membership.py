"""Presence out of tokens."""

from __future__ import annotations

from quadriga.shared.bus.membership import Presence


def test_who_is_there_is_known_by_stage_until_the_token_vanishes() -> None:
    presence = Presence("own")
    for key in ("team/r1/here/a", "team/r2/here/b", "team/r1/ready/a", "team/sim/here/own"):
        presence.note(key, there=True)
    assert presence.at("here") == {"r1", "r2"}
    assert presence.at("ready") == {"r1"}
    presence.note("team/r1/here/a", there=False)
    presence.note("team/r9/here/z", there=False)
    assert presence.at("here") == {"r2"}


def test_two_sessions_of_one_name_are_duplicates() -> None:
    presence = Presence("own")
    for key in ("team/r1/here/a", "team/r1/here/b", "team/r2/here/c"):
        presence.note(key, there=True)
    assert presence.duplicates("here", []) == {"r1"}
    assert presence.duplicates("here", ["r2"]) == {"r1", "r2"}
    assert presence.duplicates("ready", ["r2"]) == set()
