"""Ticks of one key: what is missing between them, and what was never sent."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import Consumed
from quadriga.shared.recording.ticks import SkippedTicks, TickTrack


@given(
    period=st.integers(1, 50), start=st.integers(0, 1000), count=st.integers(2, 60), data=st.data()
)
def test_every_missing_message_is_counted(
    period: int, start: int, count: int, data: st.DataObject
) -> None:
    every = [start + period * k for k in range(count)]
    gone = data.draw(st.sets(st.sampled_from(every[1:-1]))) if count > 2 else set()
    track = TickTrack(period)
    for tick in every:
        if tick not in gone:
            track.note(tick)
    assert track.lost == len(gone)
    assert (track.first, track.last, track.count) == (every[0], every[-1], count - len(gone))
    missing = sum((after - before) // period - 1 for before, after in track.gaps)
    assert missing == len(gone)


@pytest.mark.parametrize(
    ("period", "before", "ticks", "lost", "gaps"),
    [
        (10, -1, [-1, 50, 50, 60, 63, -1, 70, 9_000_000_000, 0, 10], 0, []),
        (0, -1, [5, 500], 0, []),
        (10, 90, [120], 2, [(90, 120)]),  # of the file before this one
        *(
            (1, -1, [*range(1100), odd, *range(1100, 1200), *range(1240, 1300)], 40, [(1199, 1240)])
            for odd in (0, 400, 1099, 5_000_000)  # out of order
        ),
    ],
)
def test_what_is_a_gap_and_what_is_none(
    period: int, before: int, ticks: list[int], lost: int, gaps: list[tuple[int, int]]
) -> None:
    track = TickTrack(period, before)
    for tick in ticks:
        track.note(tick)
    assert (track.lost, track.gaps, track.count) == (lost, gaps, len(ticks))
    assert track.first == next(tick for tick in ticks if tick >= 0)


def test_what_was_never_sent_is_not_lost() -> None:
    track = TickTrack(1)
    for tick in (0, 4, 7):
        track.note(tick)
    assert track.lost == 5
    track.skip(3)
    assert track.lost == 2
    track.skip(1 << 40)
    assert track.lost == 0


def consumed(passed: int) -> bytes:
    return encode(Consumed(53, 0, 0, passed, (), ()))


@pytest.mark.parametrize(
    ("mode", "key", "payload", "found"),
    [
        ("realtime", "team/r2/inputs", consumed(3), ("team/r2/command", 3)),
        ("realtime", "team/r2/inputs", consumed(0), None),
        ("realtime", "team/r2/inputs", b"\xc1", None),
        ("realtime", "team/r3/inputs", consumed(3), None),
        ("lockstep", "team/r2/inputs", consumed(3), None),
    ],
)
def test_an_agent_says_how_many_ticks_it_skipped(
    mode: str, key: str, payload: bytes, found: tuple[str, int] | None
) -> None:
    config = load(None, {"team.robots": 2, "world.mode": mode})
    assert SkippedTicks(config).find(key, payload) == found
