"""How old plans and measurements of a peer are that come over a lossy network, by transport.

`python -m benchmarks.air` (as root) has two processes, each in a network namespace of its own, send
each other plans and measurements at the rates of a walk, over each transport of Zenoh, while the
air between them loses and delays packets. It is unencrypted: TLS is TCP, and QUIC with certificates
is QUIC, as far as lost packets go. Prints, and writes as JSON with `--json`, the age of the
newest one, looked at every 10 ms: what an agent plans with. A peer is lost, and the team stops,
once its newest plan is older than the planner bears; "stops" counts how often that came to be.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.faults.network.emulated import EmulatedNetwork
from quadriga.faults.network.layout import NETWORKS, NetworkLayout
from quadriga.faults.network.link import LinkFaults
from quadriga.faults.network.order import RadioOrder
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import max_ages, periods
from quadriga.shared.errors import ProcessError, QuadrigaError
from quadriga.shared.members import plant_name
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.signals import interrupt_on_sigterm
from quadriga.shared.topics import MEASUREMENT, PLAN, SAMPLE_MS
from quadriga.tables import Table, print_tables

_ROBOTS: Final = ("r1", "r2")
_NAMES: Final = (plant_name("r1"), "r2")  # the first is found by the other
_PORT: Final = 7447
_PERIODS: Final = {PLAN: periods(Config())[PLAN.name], MEASUREMENT: SAMPLE_MS}  # ms
_SETTLE_NS: Final = 1_000_000_000
# A plan is made of data of its own step, and a peer without one is given up after this.
_PATIENCE_MS: Final = max_ages(Config())[PLAN.name]
_CASES: Final = ((20, 0), *((loss, trip) for trip in (20, 50) for loss in (1, 5, 20)))


@dataclass(frozen=True, slots=True)
class AirTransport:
    """A way to send.

    Attributes:
        name: in the table.
        endpoint: with the place of the address.
        rto_min_ms: as of `NetworkLayout`.
    """

    name: str
    endpoint: str
    rto_min_ms: int = 0


TRANSPORTS: Final = (
    AirTransport("tcp", "tcp/{}"),
    AirTransport("tcp, rto_min 20 ms", "tcp/{}", 20),
    AirTransport("quic", "udp/{}?rel=1"),
    AirTransport("udp", "udp/{}"),
)


def main() -> int:
    """Measure and print; 0 if everything could be measured."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0, help="of each case")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all rows there")
    given = parser.parse_args()
    interrupt_on_sigterm()
    rows = list[dict[str, Any]]()
    try:
        for case in _CASES:
            rows += measure_case(*case, given.seconds)
            print(f"air: {len(rows)} of {len(_CASES) * len(TRANSPORTS)}", file=sys.stderr)
            if given.json is not None:  # after each case: all of them take minutes
                given.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    except QuadrigaError as error:
        print(f"air: {error}", file=sys.stderr)
        return 2
    print_tables([build_age_table(rows)])
    return 0


def measure_case(loss: int, trip: int, seconds: float) -> list[dict[str, Any]]:
    """All transports at once, each over an air of its own.

    Args:
        loss: of packets, each way, %.
        trip: round trip, ms.
        seconds: for how long.
    """
    faults = LinkFaults(loss=0.01 * loss, delay=0.5 * trip)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        pairs = [
            _Pair(stack, transport, number, seconds, folder)
            for number, transport in enumerate(TRANSPORTS)
        ]
        for pair in pairs:
            pair.await_ready()
        for pair in pairs:
            pair.begin(faults)
        return [{"loss": loss, "round_trip_ms": trip} | pair.result() for pair in pairs]


class _Pair:
    """Two processes over one transport, each at a place of its own."""

    def __init__(
        self, stack: ExitStack, transport: AirTransport, number: int, seconds: float, folder: Path
    ) -> None:
        self._transport, self._seconds = transport, seconds
        number += os.getpid()
        layout = NetworkLayout(number % NETWORKS, _ROBOTS, False, transport.rto_min_ms)
        self._network = stack.enter_context(
            EmulatedNetwork(layout, number, folder / f"{number}.log")
        )
        hub = transport.endpoint.format(f"{layout.address(_ROBOTS[0])}:{_PORT}")
        self._peers = [
            self._start(stack, names, place, hub)
            for names, place in zip((_NAMES, _NAMES[::-1]), _ROBOTS, strict=True)
        ]

    def _start(
        self, stack: ExitStack, names: Sequence[str], place: str, hub: str
    ) -> subprocess.Popen[str]:
        listen = self._transport.endpoint.format(f"{self._network.layout.address(place)}:0")
        command = [*self._network.enter(place), sys.executable, "-m", "benchmarks.air_peer"]
        command += [*names, hub, listen, str(self._seconds), str(os.getpid())]
        pipe = subprocess.PIPE
        peer = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
        stack.enter_context(peer)
        stack.callback(peer.kill)  # before it is waited for
        return peer

    def await_ready(self) -> None:
        """Wait until both are linked."""
        for peer in self._peers:
            self._read(peer)

    def begin(self, faults: LinkFaults) -> None:
        """Spoil the air, and have both send."""
        self._network.order(RadioOrder(_ROBOTS[1], faults))
        for peer in self._peers:
            if peer.stdin is not None:
                peer.stdin.write("go\n")
                peer.stdin.flush()

    def result(self) -> dict[str, Any]:
        """What became of the messages of both."""
        heard = [json.loads(self._read(peer)) for peer in self._peers]
        return {"transport": self._transport.name} | {
            topic.name: describe_ages(
                [ages_of(one[topic.name], one["begun"], one["ended"]) for one in heard],
                sum(len(one[topic.name]) for one in heard)
                / (len(heard) * self._seconds * 1e3 / period),
            )
            for topic, period in _PERIODS.items()
        }

    def _read(self, peer: subprocess.Popen[str]) -> str:
        line = peer.stdout.readline() if peer.stdout is not None else ""
        if not line:
            name = self._transport.name
            raise ProcessError(f"a process of {name!r}", "its end", "messages over this transport")
        return line


def ages_of(arrivals: Sequence[Sequence[int]], begun: int, ended: int) -> Array:
    """Age of the newest message at each sample, ms; infinite without any.

    Args:
        arrivals: when each message arrived, and its stamp, ns.
        begun: when the sender began, ns; the first second is left out.
        ended: when it ended.
    """
    looks = np.arange(begun + _SETTLE_NS, ended, round(1e6 * SAMPLE_MS))
    if not arrivals:
        return np.full(len(looks), np.inf)
    at, stamps = np.array(arrivals, dtype=np.int64).T
    newest = np.maximum.accumulate(stamps)
    known = np.searchsorted(at, looks, side="right") - 1
    return np.where(known < 0, np.inf, 1e-6 * (looks - newest[known]))


def describe_ages(ages: Sequence[Array], received: float) -> dict[str, float]:
    """Figures of the ages on both sides, and the share of messages that arrived at all."""
    every = np.concatenate(ages)
    p50, p99 = np.percentile(every, (50, 99), method="higher")
    lost = [(age > _PATIENCE_MS).astype(int) for age in ages]
    return {
        "p50": float(p50),
        "p99": float(p99),
        "max": float(every.max()),
        "received": received,
        "stops": int(sum(np.sum(np.diff(late) > 0) + late[0] for late in lost)),
    }


def build_age_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """A line for each case and transport."""
    columns = ["loss %", "round trip ms", "transport"]
    for topic in _PERIODS:
        columns += [f"{topic.name} {name}" for name in ("p50", "p99", "max", "received %")]
    lines = [
        (
            *(str(row["loss"]), str(row["round_trip_ms"]), row["transport"]),
            *(cell for topic in _PERIODS for cell in _cells(row[topic.name])),
            str(row[PLAN.name]["stops"]),
        )
        for row in rows
    ]
    note = f"Ages in ms. Stops: how often the newest plan was older than {_PATIENCE_MS} ms."
    return Table(
        "Ages of a peer's messages over the air", (*columns, "stops"), tuple(lines), [note]
    )


def _cells(figures: Mapping[str, float]) -> list[str]:
    ages = [f"{figures[name]:.0f}" for name in ("p50", "p99", "max")]
    return [*ages, f"{100 * figures['received']:.0f}"]


if __name__ == "__main__":
    sys.exit(main())
