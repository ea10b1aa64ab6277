"""What drivers say: only what is whole and finite counts, within the limits."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.drive.driver_words import (
    DRIVE,
    ESTOP,
    KINDS,
    MOST_BYTES,
    DriverWord,
    read_driver_word,
)
from quadriga.drive.wish import NAMES, Wish, limits
from quadriga.shared.errors import MessageError

WISH = {"vx": 0.4, "vy": 0.0, "wz": -0.2, "height": 0.26}


def text(**body: Any) -> str:
    return json.dumps(body)


def test_a_wish_within_the_limits_is_what_was_asked_for() -> None:
    said = read_driver_word(text(kind=DRIVE, held=True, number=7, **WISH))
    assert said == DriverWord(DRIVE, Wish(**WISH), held=True, number=7)
    assert not read_driver_word(text(kind=DRIVE, held=1, **WISH)).held, "only true is"


def test_a_wish_beyond_the_limits_is_brought_within_them() -> None:
    said = read_driver_word(text(kind=DRIVE, held=True, vx=1e300, vy=-1e300, wz=9, height=0))
    assert said.wish == Wish(1.2, -0.5, 1.0, 0.2)


@pytest.mark.parametrize(
    "wrong",
    [
        "",
        "{",
        "[]",
        "5",
        "null",
        '"estop"',
        "[" * 1000,
        "{}",
        text(kind="fly"),
        text(kind=["estop"]),
        text(kind=ESTOP, number=-1),
        text(kind=ESTOP, number=True),
        text(kind=ESTOP, text=5),
        text(kind=DRIVE, held=True),
        text(kind=DRIVE, **{**WISH, "vx": "fast"}),
        text(kind=DRIVE, **{**WISH, "vx": True}),
        text(kind=DRIVE, **{**WISH, "vx": float("nan")}),
        text(kind=DRIVE, **{**WISH, "wz": None}),
        text(kind=DRIVE, **{**WISH, "vy": 10**400}),
        text(kind=ESTOP, text="x" * MOST_BYTES),
    ],
)
def test_all_else_is_refused_in_a_line(wrong: str) -> None:
    with pytest.raises(MessageError, match=r"^what a driver says: got .*, expected"):
        read_driver_word(wrong)


@given(st.binary(max_size=MOST_BYTES + 9) | st.text(max_size=300))
def test_noise_is_a_word_or_refused(noise: bytes | str) -> None:
    try:
        said = read_driver_word(noise)
    except MessageError:
        return
    assert said.kind in KINDS


@given(st.dictionaries(st.sampled_from([*NAMES, "held", "kind"]), st.floats() | st.integers()))
def test_no_number_leads_beyond_the_limits(body: dict[str, Any]) -> None:
    try:
        said = read_driver_word(json.dumps({**WISH, **body, "kind": DRIVE}))
    except MessageError:
        return
    for name, (low, high) in limits().items():
        assert low <= getattr(said.wish, name) <= high


def test_nobody_sends_escape_sequences_to_a_terminal() -> None:
    assert read_driver_word(text(kind=ESTOP, text="\x1b[2Jdog")).text.isprintable()
