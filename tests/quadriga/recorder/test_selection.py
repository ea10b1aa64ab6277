"""What is recorded if nobody asks for anything else."""

from __future__ import annotations

from dataclasses import replace

import pytest

from quadriga.recorder import selection
from quadriga.recorder.selection import KeyFilter, Selection
from quadriga.shared.wire.topics import STATE, TABLE


def test_what_the_table_does_not_have_recorded_is_recorded_if_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    key = STATE.key("team", "r1")
    assert KeyFilter("team", Selection()).all
    monkeypatch.setattr(selection, "TABLE", (replace(STATE, recorded=False), *TABLE[1:]))
    usual = KeyFilter("team", Selection())
    assert not usual.all
    assert not usual(key)
    assert usual("team/r1/command")
    assert KeyFilter("team", Selection(topics=("state",)))(key)
