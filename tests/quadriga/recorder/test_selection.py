"""What is recorded if nobody asks for anything else."""

from __future__ import annotations

from quadriga.recorder.selection import KeyFilter, Selection, own_keys
from quadriga.shared.recording.quota import MAX_FOREIGN_KEYS
from quadriga.shared.topics import CLOCK


def test_what_the_table_does_not_have_recorded_is_recorded_if_asked_for() -> None:
    usual, key = KeyFilter("team", Selection()), CLOCK.key("team")
    assert not CLOCK.recorded
    assert not usual.all
    assert not usual(key)
    assert usual("team/r1/command")
    assert KeyFilter("team", Selection(topics=("clock",)))(key)


def test_the_keys_of_a_team_are_those_of_its_members_and_no_others() -> None:
    own = own_keys("band")
    assert {"band/r1/state", "band/r10/command", "band/sim/status", "band/plant_r2/status"} < own
    assert {"band/planner/status", "band/reference", "band/sim/truth", "band/estop"} < own
    assert not {"band/r11/state", "band/x/state", "team/r1/state", "band/new/key"} & own


def test_keys_without_end_do_not_fill_the_memory() -> None:
    usual = KeyFilter("team", Selection())
    assert all(usual(f"team/flood/{k}") for k in range(5000))
    assert usual("team/r1/command")
    assert len(usual._known) <= MAX_FOREIGN_KEYS
