"""The remote control: its buttons by their bits, its sticks, and any bytes."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.errors import ConfigError
from quadriga.shared.unitree.remote import (
    BUTTONS,
    RemoteReading,
    are_pressed,
    parse_buttons,
    read_remote,
    write_remote,
)

STICK = st.floats(-1.0, 1.0, width=32)


@given(st.frozensets(st.sampled_from(BUTTONS)), STICK, STICK, STICK, STICK)
def test_a_reading_comes_back(
    pressed: frozenset[str], lx: float, ly: float, rx: float, ry: float
) -> None:
    reading = RemoteReading(True, pressed, lx, ly, rx, ry)
    assert read_remote(write_remote(reading)) == reading


def test_the_bits_and_places_are_unitrees() -> None:
    packet = bytearray(40)
    struct.pack_into("<H", packet, 2, 1 << 5 | 1 << 9)
    for at, stick in ((4, 0.1), (8, 0.2), (12, 0.3), (20, 0.4)):
        struct.pack_into("<f", packet, at, stick)
    read = read_remote(bytes(packet))
    assert read.pressed == {"L2", "B"}
    assert (read.lx, read.rx, read.ry, read.ly) == pytest.approx((0.1, 0.2, 0.3, 0.4))


def test_all_zeros_are_a_remote_that_is_off() -> None:
    assert read_remote(bytes(40)) == RemoteReading(False, frozenset())
    assert write_remote(RemoteReading(False, frozenset({"A"}))) == bytes(40)


@given(st.binary(min_size=40, max_size=40))
def test_any_bytes_have_sticks_within_their_range(packet: bytes) -> None:
    read = read_remote(packet)
    assert all(-1.0 <= stick <= 1.0 for stick in (read.lx, read.ly, read.rx, read.ry))


def test_buttons_pressed_together_are_named() -> None:
    assert parse_buttons("L2 + B", "bridge.stop") == {"L2", "B"}
    with pytest.raises(ConfigError, match=r"bridge\.stop: got 'L3', expected buttons of R1, L1"):
        parse_buttons("L3", "bridge.stop")


@given(st.frozensets(st.sampled_from(BUTTONS)), st.frozensets(st.sampled_from(BUTTONS)))
def test_buttons_are_pressed_together(pressed: frozenset[str], wanted: frozenset[str]) -> None:
    packet = write_remote(RemoteReading(True, pressed))
    assert are_pressed(packet, wanted) == (wanted <= pressed)
    assert are_pressed(packet, wanted) == (wanted <= read_remote(packet).pressed)
