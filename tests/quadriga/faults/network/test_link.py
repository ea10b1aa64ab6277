"""A link: it does what is asked for and nothing else, and the same again for the same seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.faults.network.link import Link, LinkFaults
from quadriga.shared.unitree.codecs import GO2
from quadriga.shared.unitree.packets import ON, MotorTargets, PacketError

N = 4000
PACKETS = [f"packet {k:06}".encode() for k in range(N)]


def run(faults: LinkFaults, count: int = N, seed: int = 0) -> list[tuple[int, bytes]]:
    """One packet each ms, then a second of waiting: when what arrived."""
    link, arrived = Link((seed, 1)), list[tuple[int, bytes]]()
    link.faults = faults
    for now in range(count + 1000):
        arrived += [(now, got) for got in link.pass_on(PACKETS[:count][now : now + 1], now)]
    return arrived


shares = st.floats(0.0, 1.0)
some_faults = st.builds(LinkFaults, shares, shares, shares, shares, st.floats(0.0, 30.0))


def test_without_faults_the_very_packets_are_handed_on() -> None:
    link, packets = Link((0,)), tuple(PACKETS[:3])
    assert link.pass_on(packets, 0) is packets
    link.faults = LinkFaults(delay=5.0)
    assert link.pass_on(packets, 1) == []
    link.faults = LinkFaults()
    assert link.next_arrival == 6.0
    assert link.pass_on((), 6) == list(packets), "what is on its way keeps its delay"
    assert link.pass_on(packets, 2000) == list(packets)


@given(some_faults, st.integers(0, 100))
def test_equal_seeds_give_equal_arrivals_none_early_or_of_nowhere(
    faults: LinkFaults, seed: int
) -> None:
    assert run(faults, 100, seed) == run(faults, 100, seed)
    arrived = run(replace(faults, garbage=0.0), 100, seed)
    sent = {packet: now for now, packet in enumerate(PACKETS[:100])}
    assert all(now >= sent[packet] + faults.delay for now, packet in arrived)
    assert len(arrived) <= 200
    assert [now for now, _ in arrived] == sorted(now for now, _ in arrived)


@pytest.mark.parametrize("share", [0.01, 0.2, 1.0])
def test_the_share_asked_for_is_lost_or_repeated_or_damaged(share: float) -> None:
    margin = 4.0 * np.sqrt(share * (1.0 - share) / N) * N  # four standard deviations
    left = run(LinkFaults(loss=share))
    assert N - len(left) == pytest.approx(share * N, abs=margin)
    assert {got for _, got in left} <= {got for _, got in run(LinkFaults(loss=0.5 * share))}
    again = len(run(LinkFaults(duplicate=share))) - N
    assert again == pytest.approx(share * N, abs=margin)
    arrived = [got for _, got in run(LinkFaults(garbage=share))]
    damaged = sum(got != sent for got, sent in zip(arrived, PACKETS, strict=True))
    assert damaged == pytest.approx(share * N, abs=margin)


@given(st.floats(0.0, 50.0), st.integers(0, 10))
def test_a_delay_is_kept_to_the_millisecond(delay: float, seed: int) -> None:
    expected = [(int(np.ceil(k + delay)), packet) for k, packet in enumerate(PACKETS[:60])]
    assert run(LinkFaults(delay=delay), 60, seed) == expected


def test_swapped_packets_change_places_with_the_next() -> None:
    order = [int(got[-6:]) for _, got in run(LinkFaults(reorder=0.3))]
    assert sorted(order) in ([*range(N)], [*range(N - 1)]), "at most the last one still waits"
    assert {got - k for k, got in enumerate(order)} == {-1, 0, 1}
    pairs = [k for k in range(len(order) - 1) if order[k] > order[k + 1]]
    assert len(pairs) / N == pytest.approx(0.3 / 1.3, abs=0.03)


def test_no_codec_takes_a_damaged_packet() -> None:
    zero, link = np.zeros(12), Link((0, 1))
    targets = MotorTargets(np.full(12, ON, np.uint8), zero, zero, zero, zero, zero + 3.0)
    packet = GO2.encode_command(targets)
    link.faults = LinkFaults(garbage=1.0)
    for now in range(300):
        (got,) = link.pass_on((packet,), now)
        with pytest.raises(PacketError):
            GO2.decode_command(got)
    assert link.pass_on((b"",), 300) == [b""], "an empty one can be sent"
