"""Commands at the world's door: only a valid one, of the right time, of a known robot gets in."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.plant.commands import FOREIGN, STALE, CommandBox
from quadriga.shared.wire.codec import MAX_TICK, encode
from quadriga.shared.wire.messages import Command, Event

KEY = "team/r1/command"


def command(tick: int, tau: float = 0.0) -> bytes:
    array = np.full(12, tau)
    return encode(Command(tick, tick * 1_000_000, array, array, array, array, array))


@pytest.fixture
def box() -> CommandBox:
    return CommandBox("team", ("r1", "r2"))


def test_the_command_of_the_tick_is_taken(box: CommandBox) -> None:
    assert box.take(KEY, command(5, 1.0), tick=5, oldest=5) == "r1"
    assert box.latest["r1"].tau[0] == 1.0
    assert (box.tick_of("r1"), box.tick_of("r2")) == (5, -1)
    assert not box.refused


@pytest.mark.parametrize("wrong", [4, 6, MAX_TICK - 1])
def test_lock_step_discards_other_ticks(box: CommandBox, wrong: int) -> None:
    assert box.take(KEY, command(wrong), tick=5, oldest=5) == ""
    assert box.refused == {(STALE, "r1"): 1}
    assert box.latest == {}


def test_a_repeated_command_does_not_count_twice(box: CommandBox) -> None:
    assert box.take(KEY, command(5, 1.0), tick=5, oldest=5) == "r1"
    assert box.take(KEY, command(5, 9.0), tick=5, oldest=5) == ""
    assert box.latest["r1"].tau[0] == 1.0


def test_real_time_takes_older_ones_but_never_goes_back(box: CommandBox) -> None:
    assert box.take(KEY, command(7), tick=9, oldest=0) == "r1"
    assert box.take(KEY, command(6), tick=9, oldest=0) == ""
    assert box.tick_of("r1") == 7


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\xc1",
        command(5, float("nan")),
        command(5, float("inf")),
        command(5)[:-1],
        encode(Event(5, 5, "fall", "r1", "", "fall")),
    ],
)
def test_what_is_malformed_is_dropped_and_counted(box: CommandBox, payload: bytes) -> None:
    assert box.take(KEY, payload, tick=5, oldest=5) == ""
    assert box.malformed == 1
    assert box.last_error.startswith("command")
    assert box.latest == {}


def test_a_robot_of_another_team_or_none_is_foreign(box: CommandBox) -> None:
    for key in ("team/r3/command", "other/r1/command", "team/r1/state"):
        assert box.take(key, command(5), tick=5, oldest=5) == ""
    assert box.refused == {(FOREIGN, ""): 3}
