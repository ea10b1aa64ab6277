"""The air: packets come where they are addressed, and a faulty radio meets its own place alone."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from quadriga.faults.network.link import LinkFaults
from quadriga.faults.network.order import RadioOrder
from quadriga.faults.network.radio import Arrivals, Radio

HOSTS = {254: "team", 1: "r1", 2: "r2"}
GONE = LinkFaults(loss=1.0)


def packet(host: int, number: int = 0) -> bytes:
    """An IPv4 header to a host of the network, and a number."""
    header = bytearray(20)
    header[0], header[19] = 0x45, host
    return bytes(header) + number.to_bytes(4, "big")


def received(arrivals: Iterable[Arrivals]) -> list[tuple[str, bytes]]:
    return [(place, packet) for place, packets in arrivals for packet in packets]


def test_packets_come_where_they_are_addressed_in_their_order() -> None:
    radio = Radio(HOSTS, 1)
    packets = [packet(2, k) for k in range(5)] + [packet(254)]
    assert received(radio.send("r1", packets, 0.0)) == [
        *(("r2", packet(2, k)) for k in range(5)),
        ("team", packet(254)),
    ]
    assert radio.next_event == float("inf")
    assert (radio.carried, radio.foreign) == (6, 0)


@pytest.mark.parametrize(
    "strange", [b"", packet(2)[:19], packet(77), packet(1), b"\x60" + packet(2)[1:]]
)
def test_what_is_for_nobody_else_here_is_dropped(strange: bytes) -> None:
    radio = Radio(HOSTS, 1)
    assert received(radio.send("r1", [strange], 0.0)) == []
    assert radio.foreign == 1


def test_a_faulty_radio_meets_its_own_place_both_ways() -> None:
    radio = Radio(HOSTS, 1)
    radio.obey(RadioOrder("r2", GONE), 0.0)
    assert received(radio.send("r1", [packet(2), packet(254)], 1.0)) == [("team", packet(254))]
    assert received(radio.send("r2", [packet(1), packet(254)], 1.0)) == []
    radio.obey(RadioOrder("r2", LinkFaults()), 2.0)
    assert received(radio.send("r2", [packet(1)], 3.0)) == [("r1", packet(1))]


def test_it_heals_when_it_is_told_to_and_wakes_for_that() -> None:
    radio = Radio(HOSTS, 1)
    radio.obey(RadioOrder("r2", GONE, 0.3), 1000.0)
    assert radio.next_event == 1300.0
    assert received(radio.arrivals(1299.9)) == []
    assert received(radio.send("r1", [packet(2)], 1299.9)) == []
    assert received(radio.arrivals(1300.0)) == []
    assert radio.next_event == float("inf")
    assert received(radio.send("r1", [packet(2)], 1300.0)) == [("r2", packet(2))]


def test_delayed_packets_arrive_when_they_are_due() -> None:
    radio = Radio(HOSTS, 1)
    radio.obey(RadioOrder("r1", LinkFaults(delay=10.0)), 0.0)
    assert received(radio.send("r1", [packet(2, 1)], 0.0)) == []
    assert received(radio.send("r2", [packet(254, 2)], 0.0)) == [("team", packet(254, 2))]
    assert radio.next_event == 10.0
    assert received(radio.arrivals(9.9)) == []
    assert received(radio.arrivals(10.0)) == [("r2", packet(2, 1))]


def test_damaged_packets_still_come_where_they_were_addressed_and_keep_their_length() -> None:
    radio = Radio(HOSTS, 3)
    radio.obey(RadioOrder("r2", LinkFaults(garbage=1.0)), 0.0)
    sent = [packet(2, k) for k in range(50)]
    arrived = received(radio.send("r1", sent, 0.0))
    assert {place for place, _ in arrived} == {"r2"}
    assert {len(got) for _, got in arrived} == {24}
    assert sum(got != was for (_, got), was in zip(arrived, sent, strict=True)) > 45


def test_an_order_survives_its_line() -> None:
    order = RadioOrder("r2", LinkFaults(loss=0.2, delay=12.5), 0.3)
    assert RadioOrder.from_line(order.to_line()) == order
    assert "\n" not in order.to_line()
