"""What the keys of a terminal and the buttons of a gamepad ask for."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.drive import gamepad as pads
from quadriga.drive.gamepad import Gamepad, wish_of
from quadriga.drive.keys import KEYS, Keys, press
from quadriga.drive.wish import Wish, approach, limit, limits

REST = Wish(0.0, 0.0, 0.0, 0.26)


def typed(*keys: bytes) -> Keys:
    state = Keys(REST)
    for key in keys:
        state = press(state, KEYS[key], REST)
    return state


def test_keys_add_up_and_count_once_the_controls_are_taken() -> None:
    assert typed(b"w", b"w", b"a").held is False
    assert typed(b"\n", b"w", b"w", b"a") == Keys(Wish(0.2, 0.0, 0.2, 0.26), held=True)
    assert typed(b"\n").word == "take"
    assert typed(b"\n", b"w").word == "", "it is said once"
    assert typed(b"\n", b"w", b"x") == Keys(REST, held=True)
    assert typed(b"\n", b"w", b" ") == Keys(REST, held=False)
    assert typed(b"\n", b"w", b"k") == Keys(REST, held=False, word="estop")
    assert typed(b"\x04").over


@given(st.lists(st.sampled_from([*KEYS]), max_size=60))
def test_no_keys_ask_for_more_than_may_be_asked_for(keys: list[bytes]) -> None:
    wish = typed(*keys).wish
    assert wish == limit(wish)


def event(value: int, kind: int, number: int) -> bytes:
    return struct.pack("<IhBB", 5, value, kind, number)


def test_sticks_ask_for_their_share_of_the_limits_and_let_go_for_nothing() -> None:
    pad = Gamepad()
    for value, axis in ((-32767, 1), (16384, 0), (3000, 3)):
        pad, button = pads.take(pad, event(value, 2, axis))
        assert button == -1
    wish = wish_of(pad, REST)
    assert wish.vx == limits()["vx"][1]
    assert wish.vy == pytest.approx(0.5 * limits()["vy"][0], rel=1e-3)
    assert wish.wz == 0.0, "within the dead zone"


def test_a_button_is_pressed_once_and_what_was_held_at_the_begin_is_no_press() -> None:
    pad, button = pads.take(Gamepad(), event(1, 0x81, pads.STOP_BUTTON))
    assert button == -1
    pad, button = pads.take(pad, event(0, 1, pads.STOP_BUTTON))
    assert (pad.pressed, button) == (frozenset(), -1)
    pad, button = pads.take(pad, event(1, 1, pads.STOP_BUTTON))
    assert pad.pressed == {pads.STOP_BUTTON}
    assert button == pads.STOP_BUTTON


@given(st.lists(st.binary(min_size=8, max_size=8), max_size=30))
def test_whatever_a_device_sends_the_wish_is_within_the_limits(events: list[bytes]) -> None:
    pad = Gamepad()
    for each in events:
        pad, _ = pads.take(pad, each)
    wish = wish_of(pad, REST)
    assert wish == limit(wish)


NUMBERS = st.floats(-2.0, 2.0)
WISHES = st.builds(Wish, NUMBERS, NUMBERS, NUMBERS, NUMBERS)


@given(WISHES, WISHES)
def test_what_is_asked_for_comes_nearer_by_no_more_than_it_may(before: Wish, goal: Wish) -> None:
    most = {"vx": 0.2, "vy": 0.1, "wz": 0.2, "height": 0.01}
    after = approach(before, goal, most)
    for name, step in most.items():
        start, end, now = (getattr(wish, name) for wish in (before, goal, after))
        assert abs(now - start) <= step + 1e-12
        assert abs(end - now) <= abs(end - start)
        assert now == end or abs(now - start) >= step - 1e-12
