"""The remote control: its buttons by their bits."""

from __future__ import annotations

import struct

from quadriga.shared.unitree.packets import BUTTONS, pressed_buttons, remote_bytes


def test_the_bits_are_unitrees_and_come_back() -> None:
    packet = bytearray(40)
    assert pressed_buttons(bytes(packet)) == frozenset()
    struct.pack_into("<H", packet, 2, 1 << 5 | 1 << 9)
    assert pressed_buttons(bytes(packet)) == {"L2", "B"}
    for pressed in (frozenset(BUTTONS[k::5]) for k in range(5)):
        assert len(remote_bytes(pressed)) == 40
        assert pressed_buttons(remote_bytes(pressed)) == pressed
