"""The check sum against its definition and the catalogue's check value."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.unitree.crc import crc32


def by_definition(packet: bytes) -> int:
    """CRC-32/MPEG-2, byte by byte and bit by bit."""
    register = 0xFFFFFFFF
    for byte in packet:
        register ^= byte << 24
        for _ in range(8):
            register = register << 1 ^ (0x04C11DB7 if register >> 31 else 0)
            register &= 0xFFFFFFFF
    return register


def test_the_definition_gives_the_catalogues_check_value() -> None:
    assert by_definition(b"123456789") == 0x0376E6E7


@given(st.binary(max_size=64))
def test_words_count_with_their_most_significant_byte_first(packet: bytes) -> None:
    words = [packet[at : at + 4][::-1] for at in range(0, len(packet) // 4 * 4, 4)]
    assert crc32(packet) == by_definition(b"".join(words))
