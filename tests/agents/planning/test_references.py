"""Which of the operator's references is in force."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planning.references import reference_at, remember_references
from quadriga.shared.messages import Reference

HEIGHT = 0.26


def reference(tick: int, vx: float = 0.0) -> Reference:
    return Reference(tick, tick * 1_000_000, vx, 0.0, 0.0, HEIGHT)


@given(st.lists(st.integers(0, 120), max_size=60), st.integers(1, 10))
def test_forgetting_changes_nothing_within_two_seconds(epochs: list[int], batch: int) -> None:
    """The memory against one that keeps everything and of each tick the first to come."""
    known: tuple[Reference, ...] = ()
    received: dict[int, Reference] = {}
    tick = 0
    for start in range(0, len(epochs), batch):
        new = tuple(
            reference(100 * epoch, float(start + i))
            for i, epoch in enumerate(epochs[start : start + batch])
        )
        for item in new:
            received.setdefault(item.tick, item)
        tick = max(tick, max(item.tick for item in new))
        known = remember_references(known, new, tick)
        ordered = [item.tick for item in known]
        assert ordered == sorted(set(ordered))
        for past in (*range(max(0, tick - 1900), tick + 1, 100), max(0, tick - 1)):
            due = [received[t] for t in sorted(received) if t <= past]
            expected = due[-1] if due else reference(0)  # before the first: to stand
            assert reference_at(known, past, HEIGHT) == (expected, past - expected.tick)


def test_the_memory_does_not_grow() -> None:
    known: tuple[Reference, ...] = ()
    for tick in range(0, 60_000, 100):
        known = remember_references(known, (reference(tick),), tick)
    assert len(known) <= 22
