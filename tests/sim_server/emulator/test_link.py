"""A link: it does what is asked for and nothing else, and the same again for the same seed."""

from __future__ import annotations

from collections.abc import Sequence

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


def build(faults: LinkFaults, seed: int = 0, *, keeps_size: bool = False) -> Link:
    link = Link((seed, 1), keeps_size=keeps_size)
    link.faults = faults
    return link


def run(link: Link, parcels: Sequence[Parcel] = PACKETS) -> list[tuple[int, Parcel]]:
    """One packet each ms, then a second of waiting: when what arrived."""
    arrived = list[tuple[int, Parcel]]()
    for now, parcel in enumerate(parcels):
        arrived += [(now, got) for got in link.pass_on((parcel,), now)]
    end = len(parcels)
    return arrived + [(now, got) for now in range(end, end + 1000) for got in link.pass_on((), now)]


shares = st.floats(0.0, 1.0)
some_faults = st.builds(
    LinkFaults,
    loss=shares,
    duplicate=shares,
    reorder=shares,
    garbage=shares,
    delay=st.floats(0.0, 30.0),
)


def test_without_faults_the_very_packets_are_handed_on() -> None:
    link = Link((0,), keeps_size=False)
    parcels = tuple(PACKETS[:3])
    assert link.pass_on(parcels, 0) is parcels
    link.faults = LinkFaults(delay=5.0)
    assert link.pass_on(parcels, 1) == []
    link.faults = LinkFaults()
    assert run(link, PACKETS[3:10])[0] == (6, PACKETS[0]), "what is on its way keeps its delay"
    assert link.pass_on(parcels, 2000) == list(parcels)


@given(some_faults, st.integers(0, 100))
def test_equal_seeds_and_packets_give_equal_arrivals(faults: LinkFaults, seed: int) -> None:
    one, other = (run(build(faults, seed), PACKETS[:100]) for _ in range(2))
    assert one == other


@given(some_faults, st.integers(0, 100))
def test_nothing_arrives_early_or_of_nowhere(faults: LinkFaults, seed: int) -> None:
    faults = LinkFaults(**{**as_dict(faults), "garbage": 0.0})
    sent = {parcel: now for now, parcel in enumerate(PACKETS[:100])}
    arrived = run(build(faults, seed), PACKETS[:100])
    assert all(now >= sent[parcel] + faults.delay for now, parcel in arrived)
    assert len(arrived) <= 200
    assert [now for now, _ in arrived] == sorted(now for now, _ in arrived)


def as_dict(faults: LinkFaults) -> dict[str, float]:
    return {name: getattr(faults, name) for name in LinkFaults.__slots__}


@pytest.mark.parametrize("share", [0.01, 0.05, 0.2, 1.0])
def test_the_share_asked_for_is_lost_or_repeated_or_damaged(share: float) -> None:
    margin = 4.0 * np.sqrt(share * (1.0 - share) / N) * N  # four standard deviations
    lost = N - len(run(build(LinkFaults(loss=share))))
    assert lost == pytest.approx(share * N, abs=margin)
    again = len(run(build(LinkFaults(duplicate=share)))) - N
    assert again == pytest.approx(share * N, abs=margin)
    damaged = sum(got not in PACKETS for _, got in run(build(LinkFaults(garbage=share)))[:N])
    assert damaged == pytest.approx(share * N, abs=margin + 0.01 * N)


def test_more_loss_loses_the_same_packets_and_some_more() -> None:
    few, many = ({got for _, got in run(build(LinkFaults(loss=share)))} for share in (0.2, 0.05))
    assert few < many


@given(st.floats(0.0, 50.0), st.integers(0, 10))
def test_a_delay_is_kept_to_the_millisecond(delay: float, seed: int) -> None:
    parcels = PACKETS[:60]
    arrived = run(build(LinkFaults(delay=delay), seed), parcels)
    assert arrived == [(int(np.ceil(k + delay)), parcel) for k, parcel in enumerate(parcels)]


def test_swapped_packets_change_places_with_the_next() -> None:
    order = [int(got.packet[-6:]) for _, got in run(build(LinkFaults(reorder=0.3)))]
    assert sorted(order) in ([*range(N)], [*range(N - 1)]), "at most the last one still waits"
    moved = [got - k for k, got in enumerate(order)]
    assert set(moved) == {-1, 0, 1}
    pairs = [k for k in range(len(order) - 1) if order[k] > order[k + 1]]
    assert len(pairs) / N == pytest.approx(0.3 / 1.3, abs=0.03)


@pytest.mark.parametrize("keeps_size", [True, False])
def test_damage_leaves_a_structs_size_alone_and_no_codec_takes_it(keeps_size: bool) -> None:
    zero = np.zeros(12)
    targets = MotorTargets(np.full(12, ON, np.uint8), zero, zero, zero, zero, zero + 3.0)
    packet = GO2.encode_command(targets)
    link = build(LinkFaults(garbage=1.0), keeps_size=keeps_size)
    sizes = set()
    for now in range(300):
        (got,) = link.pass_on((Parcel(packet, SENDER),), now)
        sizes.add(len(got.packet))
        assert got.sender == SENDER
        with pytest.raises(PacketError):
            GO2.decode_command(got.packet)
    assert (sizes == {len(packet)}) is keeps_size


def test_an_empty_packet_can_be_damaged() -> None:
    link = build(LinkFaults(garbage=1.0))
    assert len(link.pass_on((Parcel(b""),), 0)) == 1
