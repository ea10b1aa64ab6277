"""A way through a network, in one direction: it loses, delays, repeats, swaps and damages packets.

Pure: time is an argument, and chance comes from a seed. Each packet draws the same numbers whatever
is asked for, so the same packets are lost at 5 % as at 1 %, and some more.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

_DAMAGE: Final = 1  # of the seed: where and how packets are damaged
_MOST_BITS: Final = 8  # that are flipped in a packet
_DRAWS: Final = 4  # of a packet: loss, repetition, swap, damage


@dataclass(frozen=True, slots=True)
class LinkFaults:
    """What a link does to packets.

    Attributes:
        loss: share of packets that do not arrive, 0 … 1.
        duplicate: share that arrive twice.
        reorder: share that change places with the next one.
        garbage: share that arrive damaged: bits flipped, cut short, or nothing but chance.
        delay: of each packet, ms.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    garbage: float = 0.0
    delay: float = 0.0


NO_FAULTS: Final = LinkFaults()


class Parcel(NamedTuple):
    """A packet, and who sent it where that is known."""

    packet: bytes
    sender: tuple[str, int] | None = None


class Link:
    """See this module.

    Attributes:
        faults: what it does from now on; packets on their way keep their delay.

    Args:
        seed: of its chance.
        keeps_size: whether damage leaves a packet's length alone, as where structs are sent: what
            is cut off is zero then.
    """

    def __init__(self, seed: Sequence[int], *, keeps_size: bool) -> None:
        self.faults = NO_FAULTS
        self._keeps_size = keeps_size
        self._chance = np.random.default_rng(tuple(seed))
        self._damage_chance = np.random.default_rng((*seed, _DAMAGE))
        self._way = deque[tuple[float, Parcel]]()  # when each arrives, ms, rising
        self._passed: tuple[Parcel, int] | None = None  # what the next packet overtakes

    def pass_on(self, parcels: Sequence[Parcel], now: float) -> Sequence[Parcel]:
        """Send packets into it, and take those that arrive by now.

        Args:
            parcels: that are sent now, in their order.
            now: ms; never less than at the last call.

        Returns:
            What arrives; `parcels` themselves where nothing is asked for.
        """
        if self.faults is NO_FAULTS and not self._way and self._passed is None:
            return parcels
        for parcel in parcels:
            self._send(parcel, now)
        arrived = []
        while self._way and self._way[0][0] <= now:
            arrived.append(self._way.popleft()[1])
        return arrived

    @property
    def next_arrival(self) -> float:
        """When the next packet on its way arrives, ms; infinity: none is on its way."""
        return self._way[0][0] if self._way else float("inf")

    def _send(self, parcel: Parcel, now: float) -> None:
        faults = self.faults
        lost, twice, swapped, damaged = self._chance.random(_DRAWS).tolist()
        if lost < faults.loss:
            return
        if damaged < faults.garbage:
            parcel = parcel._replace(packet=self._damage(parcel.packet))
        copies = 2 if twice < faults.duplicate else 1
        if self._passed is None and swapped < faults.reorder:
            self._passed = parcel, copies
            return
        self._queue(parcel, copies, now + faults.delay)
        if self._passed is not None:
            self._queue(*self._passed, now + faults.delay)
            self._passed = None

    def _queue(self, parcel: Parcel, copies: int, due: float) -> None:
        if self._way:
            due = max(due, self._way[-1][0])
        self._way.extend([(due, parcel)] * copies)

    def _damage(self, packet: bytes) -> bytes:
        """The packet with flipped bits, or its beginning, or chance."""
        chance, size = self._damage_chance, len(packet)
        kind = chance.integers(3) if size else 2
        if kind == 0:
            bits = np.unpackbits(np.frombuffer(packet, np.uint8))
            flipped = chance.choice(bits.size, chance.integers(1, _MOST_BITS + 1), replace=False)
            bits[flipped] ^= 1
            return np.packbits(bits).tobytes()
        if kind == 1:
            rest = packet[: chance.integers(size)]
            return rest.ljust(size, b"\0") if self._keeps_size else rest
        return chance.bytes(size if self._keeps_size else int(chance.integers(2 * size + 2)))
