"""Which of the operator's references is in force."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planning.references import reference_at, remember_references
from quadriga.shared.messages import Reference

HEIGHT = 0.26


def reference(tick: int, vx: float = 0.0) -> Reference:
    return Reference(tick, tick * 1_000_000, vx, 0.0, 0.0, HEIGHT)


def test_before_the_first_reference_the_robot_is_asked_to_stand() -> None:
    found, age = reference_at((), 250, HEIGHT)
    assert (found.vx, found.vy, found.wz, found.height) == (0.0, 0.0, 0.0, HEIGHT)
    assert age == 250


def test_a_reference_is_in_force_from_its_tick_until_the_next() -> None:
    known = remember_references((), (reference(100, 0.1), reference(200, 0.2)), 50)
    assert reference_at(known, 99, HEIGHT)[0].vx == 0.0
    assert reference_at(known, 100, HEIGHT) == (reference(100, 0.1), 0)
    assert reference_at(known, 199, HEIGHT) == (reference(100, 0.1), 99)
    assert reference_at(known, 200, HEIGHT) == (reference(200, 0.2), 0)


def test_of_two_references_of_one_tick_the_first_heard_stays() -> None:
    known = remember_references((), (reference(100, 0.1), reference(100, 0.7)), 100)
    known = remember_references(known, (reference(100, 0.9),), 150)
    assert [item.vx for item in known] == [0.1]


@given(st.lists(st.integers(0, 120), max_size=60), st.integers(1, 10))
def test_forgetting_changes_nothing_within_two_seconds(epochs: list[int], batch: int) -> None:
    """The memory against one that keeps everything, whatever order references come in."""
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
        for past in range(max(0, tick - 1900), tick + 1, 100):
            due = [received[t] for t in sorted(received) if t <= past]
            assert reference_at(known, past, HEIGHT)[0] == (due[-1] if due else reference(0))


def test_the_memory_does_not_grow() -> None:
    known: tuple[Reference, ...] = ()
    for tick in range(0, 60_000, 100):
        known = remember_references(known, (reference(tick),), tick)
    assert len(known) <= 22
