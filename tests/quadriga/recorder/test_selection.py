"""What is recorded if nobody asks for anything else."""

from __future__ import annotations

from quadriga.recorder.selection import KeyFilter, Selection
from quadriga.shared.wire.topics import CLOCK


def test_what_the_table_does_not_have_recorded_is_recorded_if_asked_for() -> None:
    usual, key = KeyFilter("team", Selection()), CLOCK.key("team")
    assert not CLOCK.recorded
    assert not usual.all
    assert not usual(key)
    assert usual("team/r1/command")
    assert KeyFilter("team", Selection(topics=("clock",)))(key)
