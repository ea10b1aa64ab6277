"""How far a process is, and how it is scheduled, as it says."""

from __future__ import annotations

import pytest

from quadriga.shared.about import ABOUT, About, scheduling_of, stage_of
from quadriga.shared.bus.discovery import describe_process
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load


@pytest.mark.parametrize(
    ("reached", "met", "stage"),
    [
        (set(), False, "started"),
        ({"here"}, False, "here"),
        ({"here"}, True, "warming-up"),
        ({"here", "ready"}, True, "ready"),
        ({"here", "ready"}, False, "ready"),
    ],
)
def test_stages(reached: set[str], met: bool, stage: str) -> None:
    assert stage_of(frozenset(reached), met=met) == stage


@pytest.mark.parametrize(
    ("wanted", "granted", "stage", "scheduling"),
    [
        (True, True, "ready", "realtime"),
        (True, False, "ready", "refused"),
        (True, False, "warming-up", "ordinary"),  # it has not asked yet
        (False, False, "ready", "ordinary"),
    ],
)
def test_scheduling(wanted: bool, granted: bool, stage: str, scheduling: str) -> None:
    assert scheduling_of(wanted=wanted, granted=granted, stage=stage) == scheduling


def test_an_answer_survives_the_wire_and_is_small() -> None:
    said = describe_process(load(None, {"team.robots": 10}), "r1", "ab" * 32)
    payload = encode(said)
    assert decode(payload, About) == said
    assert len(payload) < 16_384
    assert ABOUT.key("team", "r1") == "team/r1/about"
