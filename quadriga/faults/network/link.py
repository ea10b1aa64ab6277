"""A way through a network, in one direction: it loses, delays, repeats, swaps and damages packets.

Pure: time is an argument, and chance comes from a seed. Each packet draws the same numbers whatever
is asked for, so the same packets are lost at 5 % as at 1 %, and some more.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

_DAMAGE: Final = 1  # of the seed: which bits are flipped
_MOST_BITS: Final = 8  # that are flipped in a packet


@dataclass(frozen=True, slots=True)
class LinkFaults:
    """What a link does to packets, by shares of them, 0 … 1."""

    loss: float = 0.0  # of packets that do not arrive
    duplicate: float = 0.0  # that arrive twice
    reorder: float = 0.0  # that change places with the next one
    garbage: float = 0.0  # that arrive with some bits flipped
    delay: float = 0.0  # of each packet, ms


NO_FAULTS: Final = LinkFaults()


class Link:
    """See this module; chance comes from `seed`.

    Attributes:
        faults: what it does from now on; packets on their way keep their delay.
    """

    def __init__(self, seed: Sequence[int]) -> None:
        self.faults = NO_FAULTS
        self._chance = np.random.default_rng(tuple(seed))
        self._damage_chance = np.random.default_rng((*seed, _DAMAGE))
        self._way = deque[tuple[float, bytes]]()  # when each arrives, ms, rising
        self._overtaken: list[bytes] = []  # by the next packet

    def pass_on(self, packets: Sequence[bytes], now: float) -> Sequence[bytes]:
        """Send packets into it now, ms, and take those that arrive by now.

        Where nothing is asked for it gives the `packets` themselves.
        """
        if self.faults is NO_FAULTS and not self._way and not self._overtaken:
            return packets
        for packet in packets:
            self._send(packet, now)
        arrived = []
        while self._way and self._way[0][0] <= now:
            arrived.append(self._way.popleft()[1])
        return arrived

    @property
    def next_arrival(self) -> float:
        """When the next packet on its way arrives, ms; infinity: none is on its way."""
        return self._way[0][0] if self._way else float("inf")

    def _send(self, packet: bytes, now: float) -> None:
        faults = self.faults
        lost, twice, swapped, damaged = self._chance.random(4).tolist()
        if lost < faults.loss:
            return
        if damaged < faults.garbage:
            packet = self._damage(packet)
        copies = [packet] * (2 if twice < faults.duplicate else 1)
        if not self._overtaken and swapped < faults.reorder:
            self._overtaken = copies
            return
        due = max(now + faults.delay, self._way[-1][0] if self._way else 0.0)
        self._way.extend((due, one) for one in (*copies, *self._overtaken))
        self._overtaken = []

    def _damage(self, packet: bytes) -> bytes:
        bits, chance = np.unpackbits(np.frombuffer(packet, np.uint8)), self._damage_chance
        if bits.size:
            count = chance.integers(1, _MOST_BITS + 1)
            bits[chance.choice(bits.size, count, replace=False)] ^= 1
        return np.packbits(bits).tobytes()
