"""Batches give back what was gathered, to the byte, with its own time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from quadriga.shared.codec import decode, encode
from quadriga.shared.link.packets import COMMAND_SIZE, STATE_SIZE
from quadriga.shared.link.ticks import TickBatch, gathered
from quadriga.shared.messages import Command, State, Ticks
from quadriga.shared.robots.conventions import Array

ROBOTS = ("r1", "r2", "r3")
BEGUN = 1_700_000_000_000_000_123  # ns since 1970

rows = st.lists(
    st.tuples(
        st.sampled_from(ROBOTS),
        st.integers(0, (1 << 42) - 1),
        st.booleans(),
        nps.arrays(np.float64, STATE_SIZE),
    ),
    max_size=40,
)


@given(rows)
def test_what_was_gathered_comes_back(items: list[tuple[str, int, bool, Array]]) -> None:
    batch, sent = TickBatch(ROBOTS), []
    for place, (robot, tick, is_state, row) in enumerate(items):
        at = BEGUN + 123_457 * place
        if is_state:
            batch.add_state(robot, tick, row, at)
            sent.append((f"team/{robot}/state", encode(State.from_row(tick, 10**6 * tick, row))))
        else:
            long = np.resize(row, COMMAND_SIZE)
            batch.add_command(robot, tick, long, at)
            of = Command.from_row(tick, 10**6 * tick, long)
            sent.append((f"team/{robot}/command", encode(of)))
    message = batch.take(5)
    assert (message is None) == (not items)
    assert batch.take(6) is None, "nothing is told twice"
    if message is None:
        return
    came = gathered("team/sim/ticks", encode(message))
    assert [(item.key, item.payload) for item in came] == sent
    assert [item.log_ns for item in came] == [BEGUN + 123_457 * k for k in range(len(items))]


def test_all_that_an_agent_answers_at_once_is_kept() -> None:
    batch = TickBatch(("r1",))
    for tick in range(100):
        batch.add_command("r1", tick, np.full(COMMAND_SIZE, tick), BEGUN)
    message = batch.take(0)
    assert message is not None
    assert [item.tick for item in gathered("team/sim/ticks", encode(message))] == list(range(100))


@pytest.mark.parametrize(
    "payload", [b"", b"\x80", encode(State.from_row(0, 0, np.zeros(STATE_SIZE)))]
)
def test_what_is_no_batch_has_nothing_in_it(payload: bytes) -> None:
    assert gathered("team/sim/ticks", payload) == []


@pytest.mark.parametrize(
    ("place", "wrong"),
    [*((0, w) for w in (1, -1, 1e300)), *((k, w) for k in (0, 1, 2) for w in (-1, np.nan, 1e300))],
)
def test_a_row_that_none_can_be_is_passed_over(place: int, wrong: float) -> None:
    """It is of a robot that is not named, or of a time that is none."""
    states = np.zeros((3, 3 + STATE_SIZE))
    states[1, place] = wrong
    forged = Ticks(0, 0, BEGUN, ("r1",), states, np.empty((0, 3 + COMMAND_SIZE)))
    assert np.array_equal(decode(encode(forged), Ticks).states, states, equal_nan=True)
    assert len(gathered("team/sim/ticks", encode(forged))) == 2


def test_who_speaks_for_one_robot_is_not_believed_of_another() -> None:
    for sender, robot, believed in (
        *(("r1", "r1", 1), ("plant_r1", "r1", 1), ("sim", "r2", 1)),
        *(("r1", "r2", 0), ("plant_r1", "r2", 0), ("sims", "r1", 0)),
    ):
        batch = TickBatch((robot,))
        batch.add_state(robot, 3, np.zeros(STATE_SIZE), BEGUN)
        message = batch.take(3)
        assert message is not None
        assert len(gathered(f"team/{sender}/ticks", encode(message))) == believed
