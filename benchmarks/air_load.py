"""What the emulated air itself costs: its delay, and its share of a core, at thousands of packets.

`python -m benchmarks.air_load` (as root) sends datagrams from one place to another in bursts, one
each millisecond, as states and commands of a team come, and prints how long they took. The share of
a core is that of the process that carries them.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.faults.network.emulated import EmulatedNetwork
from quadriga.faults.network.layout import NETWORKS, TEAM, NetworkLayout
from quadriga.shared.errors import QuadrigaError
from quadriga.shared.runtime.clock import Rate, monotonic_ns
from quadriga.shared.runtime.scheduling import take_priority
from quadriga.shared.runtime.signals import die_with_parent, interrupt_on_sigterm

_PORT: Final = 5005
_BYTES: Final = 600  # about those of a state or a command
_SIZE: Final = 8  # bytes of a stamp
_END: Final = 1.0  # s without a packet


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rate", type=int, default=8000, help="packets in a second (%(default)s)")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--from", dest="sender", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.sender:
        address, parent = given.sender
        die_with_parent(int(parent))
        _send(address, given.rate, given.seconds)
        return 0
    interrupt_on_sigterm()
    try:
        print(json.dumps(measure(given.rate, given.seconds), indent=1))
    except QuadrigaError as error:
        print(f"air_load: {error}", file=sys.stderr)
        return 2
    return 0


def measure(rate: int, seconds: float) -> dict[str, Any]:
    """Delays of the packets, ms, and the air's share of a core."""
    layout = NetworkLayout(os.getpid() % NETWORKS, ("r1",), wired=False)
    with (
        tempfile.TemporaryDirectory() as folder,
        EmulatedNetwork(layout, 0, Path(folder) / "air.log") as network,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link,
    ):
        link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        link.bind((layout.address(TEAM), _PORT))
        link.settimeout(20 * _END)
        words = [*network.enter("r1"), sys.executable, "-m", "benchmarks.air_load"]
        words += ["--rate", str(rate), "--seconds", str(seconds)]
        words += ["--from", layout.address(TEAM), str(os.getpid())]
        take_priority("realtime")
        before = network.processor_s
        with subprocess.Popen(words):
            delays = _receive(link)
        used = network.processor_s - before
    p50, p99 = np.percentile(delays, (50, 99))
    return {
        "packets_per_s": rate,
        "received": len(delays) / (rate * seconds),
        "p50_ms": float(p50),
        "p99_ms": float(p99),
        "max_ms": float(np.max(delays)),
        "share_of_a_core": used / seconds,
    }


def _receive(link: socket.socket) -> list[float]:
    """Delay of each packet until none comes any more, ms."""
    delays = list[float]()
    while True:
        try:
            packet = link.recv(_BYTES)
        except TimeoutError:
            return delays
        link.settimeout(_END)
        delays.append(1e-6 * (monotonic_ns() - int.from_bytes(packet[:_SIZE], "big")))


def _send(address: str, rate: int, seconds: float) -> None:
    take_priority("realtime")
    burst, rest = rate // 1000, bytes(_BYTES - _SIZE)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.connect((address, _PORT))
        pace = Rate(1e-3)
        for _ in range(round(1e3 * seconds)):
            pace.wait()
            for _ in range(burst):
                link.send(monotonic_ns().to_bytes(_SIZE, "big") + rest)


if __name__ == "__main__":
    sys.exit(main())
