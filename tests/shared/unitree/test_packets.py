"""The remote control: its buttons by their bits."""

from __future__ import annotations

import struct

import pytest

from quadriga.shared.errors import ConfigError
from quadriga.shared.unitree.packets import BUTTONS, parse_buttons, pressed_buttons, remote_bytes


def test_the_bits_are_unitrees_and_come_back() -> None:
    packet = bytearray(40)
    assert pressed_buttons(bytes(packet)) == frozenset()
    struct.pack_into("<H", packet, 2, 1 << 5 | 1 << 9)
    assert pressed_buttons(bytes(packet)) == {"L2", "B"}
    for pressed in (frozenset(BUTTONS[k::5]) for k in range(5)):
        assert len(remote_bytes(pressed)) == 40
        assert pressed_buttons(remote_bytes(pressed)) == pressed


def test_buttons_pressed_together_are_named() -> None:
    assert parse_buttons("L2 + B", "bridge.stop") == {"L2", "B"}
    with pytest.raises(ConfigError, match=r"bridge\.stop: got 'L3', expected buttons of R1, L1"):
        parse_buttons("L3", "bridge.stop")
