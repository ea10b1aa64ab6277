"""Who drives: the first who takes the controls and is heard; all others wait."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from quadriga.drive.charge import (
    NOBODY_DRIVES,
    SILENT_MS,
    InCharge,
    hear,
    lapse,
    leave,
    release,
    take,
    why_stand,
)
from quadriga.drive.wish import Wish

REST, AHEAD = Wish(0.0, 0.0, 0.0, 0.26), Wish(0.4, 0.0, 0.0, 0.26)


def driven(by: str = "page 1", at: int = 1000) -> InCharge:
    return hear(take(InCharge(), by, at), by, AHEAD, at, held=True)


def test_nobody_drives_before_somebody_takes_the_controls() -> None:
    nobody = InCharge()
    assert why_stand(nobody) == NOBODY_DRIVES
    assert hear(nobody, "page 1", AHEAD, 5, held=True) is nobody
    assert why_stand(take(nobody, "page 1", 5)) == "page 1 does not hold on", (
        "nor asks for anything"
    )
    assert not why_stand(driven())


def test_a_second_driver_cannot_take_them_while_the_first_is_heard() -> None:
    first = driven()
    assert take(first, "page 2", 1000 + SILENT_MS) is first
    assert take(first, "page 2", 1001 + SILENT_MS).driver == "page 2"
    assert hear(first, "page 2", REST, 1001, held=True) is first
    assert release(first, "page 2") is first
    assert leave(first, "page 2") is first


def test_the_team_stands_as_soon_as_nobody_holds_on() -> None:
    first = driven()
    assert why_stand(hear(first, "page 1", AHEAD, 1100, held=False)) == "page 1 does not hold on"
    assert why_stand(lapse(first, 1000 + SILENT_MS)) == ""
    assert why_stand(lapse(first, 1001 + SILENT_MS)) == "page 1 is silent"
    assert why_stand(release(first, "page 1")) == "page 1 gave the controls back"
    assert why_stand(leave(first, "page 1")) == "page 1 is gone"


def test_who_was_silent_must_take_the_controls_again() -> None:
    silent = lapse(driven(), 1001 + SILENT_MS)
    assert why_stand(hear(silent, "page 1", AHEAD, 1400, held=True)) == "page 1 is silent"


ACTS = st.lists(
    st.tuples(
        st.sampled_from(["take", "hear", "let go", "release", "leave", "wait"]),
        st.sampled_from(["a", "b"]),
        st.integers(0, 2 * SILENT_MS),
    ),
    max_size=40,
)


@given(ACTS)
def test_whatever_they_do_only_who_took_the_controls_and_holds_on_is_followed(
    acts: list[tuple[str, str, int]],
) -> None:
    charge, now = InCharge(), 0
    taken: dict[str, int] = {}
    for act, who, passed in acts:
        now += passed
        charge = lapse(charge, now)
        if act == "take":
            charge = take(charge, who, now)
            taken[who] = now
        elif act in ("hear", "let go"):
            charge = hear(charge, who, AHEAD, now, held=act == "hear")
        elif act == "release":
            charge = release(charge, who)
        elif act == "leave":
            charge = leave(charge, who)
        if not why_stand(charge):
            assert charge.driver in taken
            assert charge.held
            assert now - charge.heard <= SILENT_MS
            assert why_stand(lapse(replace(charge), charge.heard + SILENT_MS + 1))
