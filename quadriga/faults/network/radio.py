"""The air between places: a link for each way from one to another. Pure: time is an argument."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations
from typing import Final

from quadriga.faults.network.link import NO_FAULTS, Link
from quadriga.faults.network.order import RadioOrder

_IPV4: Final = 0x4  # the first half of a packet's first byte
_LAST_OF_DESTINATION: Final = 19  # byte of an IPv4 header
_SMALLEST: Final = 20  # bytes of that header

Arrivals = tuple[str, Sequence[bytes]]  # a place, and what arrives there


class Radio:
    """See this module.

    Args:
        hosts: place by the last byte of its address.
        seed: of all chance.

    Attributes:
        carried: packets that it has taken in.
        foreign: packets for nobody here.
    """

    def __init__(self, hosts: Mapping[int, str], seed: int) -> None:
        self._hosts = hosts
        self._ways = {
            (sender, receiver): Link((seed, number))
            for number, (sender, receiver) in enumerate(permutations(hosts.values(), 2))
        }
        self._heals: dict[str, float] = {}  # when the radio of a place is whole again, ms
        self.carried = self.foreign = 0

    def obey(self, order: RadioOrder, now: float) -> None:
        """From now on, ms, the radio of a place does this to all packets, both ways."""
        for way, link in self._ways.items():
            if order.place in way:
                link.faults = order.faults
        self._heals.pop(order.place, None)
        if order.seconds is not None:
            self._heals[order.place] = now + 1e3 * order.seconds

    def send(self, sender: str, packets: Sequence[bytes], now: float) -> Iterator[Arrivals]:
        """Take in what leaves a place now, ms; what arrives at once.

        Call `arrivals` before: what is due by now comes first.
        """
        self.carried += len(packets)
        sorted_by = dict[str, list[bytes]]()
        for packet in packets:
            receiver = self._receiver(packet)
            if receiver is None or receiver == sender:
                self.foreign += 1
            else:
                sorted_by.setdefault(receiver, []).append(packet)
        for receiver, those in sorted_by.items():
            yield receiver, self._ways[sender, receiver].pass_on(those, now)

    def arrivals(self, now: float) -> Iterator[Arrivals]:
        """What arrives by now, ms, of all that was sent before."""
        for place in [place for place, at in self._heals.items() if at <= now]:
            self.obey(RadioOrder(place, NO_FAULTS), now)
        for (_, receiver), link in self._ways.items():
            if link.next_arrival <= now:
                yield receiver, link.pass_on((), now)

    @property
    def next_event(self) -> float:
        """When `arrivals` must be asked again at the latest, ms; infinity: not by itself."""
        arrivals = min(link.next_arrival for link in self._ways.values())
        return min(arrivals, *self._heals.values(), float("inf"))

    def _receiver(self, packet: bytes) -> str | None:
        if len(packet) < _SMALLEST or packet[0] >> 4 != _IPV4:
            return None
        return self._hosts.get(packet[_LAST_OF_DESTINATION])
