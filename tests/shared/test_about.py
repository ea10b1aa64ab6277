"""How far a process is, and how it is scheduled, as it says."""

from __future__ import annotations

from quadriga.shared.about import ABOUT, About, scheduling_of, stage_of
from quadriga.shared.bus.discovery import describe_process
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load


def test_how_far_a_process_is_and_how_it_is_scheduled() -> None:
    here, both = frozenset({"here"}), frozenset({"here", "ready"})
    stages = [stage_of(frozenset(), met=False), stage_of(here, met=False), stage_of(here, met=True)]
    assert [*stages, stage_of(both, met=False)] == ["started", "here", "warming-up", "ready"]
    assert scheduling_of(wanted=True, granted=True, stage="ready") == "realtime"
    assert scheduling_of(wanted=True, granted=False, stage="ready") == "refused"
    # It has not asked yet, or will not.
    assert scheduling_of(wanted=True, granted=False, stage="warming-up") == "ordinary"
    assert scheduling_of(wanted=False, granted=False, stage="ready") == "ordinary"


def test_an_answer_survives_the_wire_and_is_small() -> None:
    said = describe_process(load(None, {"team.robots": 10}), "r1", "ab" * 32)
    payload = encode(said)
    assert decode(payload, About) == said
    assert len(payload) < 16_384
    assert ABOUT.key("team", "r1") == "team/r1/about"
