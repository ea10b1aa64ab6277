"""The remote control: its buttons by their bits."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.errors import ConfigError
from quadriga.shared.unitree.packets import BUTTONS, parse_buttons, pressed_buttons, remote_bytes

SOME = st.frozensets(st.sampled_from(BUTTONS))


def test_the_bits_are_unitrees() -> None:
    packet = bytearray(40)
    struct.pack_into("<H", packet, 2, 1 << 5 | 1 << 9)
    assert pressed_buttons(bytes(packet)) == {"L2", "B"}
    assert pressed_buttons(bytes(40)) == frozenset()


def test_buttons_pressed_together_are_named() -> None:
    assert parse_buttons("L2 + B", "bridge.stop") == {"L2", "B"}
    with pytest.raises(ConfigError, match=r"bridge\.stop: got 'L3', expected buttons of R1, L1"):
        parse_buttons("L3", "bridge.stop")


@given(SOME)
def test_buttons_come_back(pressed: frozenset[str]) -> None:
    packet = remote_bytes(pressed)
    assert len(packet) == 40
    assert pressed_buttons(packet) == pressed
