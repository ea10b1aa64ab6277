"""A link: it does what is asked for and nothing else, and the same again for the same seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.unitree.codecs import GO2
from quadriga.shared.unitree.packets import ON, MotorTargets, PacketError
from quadriga.sim_server.emulator.link import Link, LinkFaults, Parcel

N = 4000
SENDER = ("127.0.0.1", 8007)
PACKETS = [Parcel(f"packet {k:06}".encode(), SENDER) for k in range(N)]


def run(faults: LinkFaults, count: int = N, seed: int = 0) -> list[tuple[int, Parcel]]:
    """One packet each ms, then a second of waiting: when what arrived."""
    link, arrived = Link((seed, 1)), list[tuple[int, Parcel]]()
    link.faults = faults
    for now in range(count + 1000):
        arrived += [(now, got) for got in link.pass_on(PACKETS[:count][now : now + 1], now)]
    return arrived


shares = st.floats(0.0, 1.0)
some_faults = st.builds(LinkFaults, shares, shares, shares, shares, st.floats(0.0, 30.0))


def test_without_faults_the_very_packets_are_handed_on() -> None:
    link, parcels = Link((0,)), tuple(PACKETS[:3])
    assert link.pass_on(parcels, 0) is parcels
    link.faults = LinkFaults(delay=5.0)
    assert link.pass_on(parcels, 1) == []
    link.faults = LinkFaults()
    assert link.next_arrival == 6.0
    assert link.pass_on((), 6) == list(parcels), "what is on its way keeps its delay"
    assert link.pass_on(parcels, 2000) == list(parcels)


@given(some_faults, st.integers(0, 100))
def test_equal_seeds_give_equal_arrivals_none_early_or_of_nowhere(
    faults: LinkFaults, seed: int
) -> None:
    assert run(faults, 100, seed) == run(faults, 100, seed)
    arrived = run(replace(faults, garbage=0.0), 100, seed)
    sent = {parcel: now for now, parcel in enumerate(PACKETS[:100])}
    assert all(now >= sent[parcel] + faults.delay for now, parcel in arrived)
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
    expected = [(int(np.ceil(k + delay)), parcel) for k, parcel in enumerate(PACKETS[:60])]
    assert run(LinkFaults(delay=delay), 60, seed) == expected


def test_swapped_packets_change_places_with_the_next() -> None:
    order = [int(got.packet[-6:]) for _, got in run(LinkFaults(reorder=0.3))]
    assert sorted(order) in ([*range(N)], [*range(N - 1)]), "at most the last one still waits"
    assert {got - k for k, got in enumerate(order)} == {-1, 0, 1}
    pairs = [k for k in range(len(order) - 1) if order[k] > order[k + 1]]
    assert len(pairs) / N == pytest.approx(0.3 / 1.3, abs=0.03)


def test_no_codec_takes_a_damaged_packet() -> None:
    zero, link = np.zeros(12), Link((0, 1))
    targets = MotorTargets(np.full(12, ON, np.uint8), zero, zero, zero, zero, zero + 3.0)
    parcel = Parcel(GO2.encode_command(targets), SENDER)
    link.faults = LinkFaults(garbage=1.0)
    for now in range(300):
        (got,) = link.pass_on((parcel,), now)
        assert got.sender == SENDER
        with pytest.raises(PacketError):
            GO2.decode_command(got.packet)
    assert link.pass_on((Parcel(b""),), 300) == [Parcel(b"")], "an empty one can be sent"
