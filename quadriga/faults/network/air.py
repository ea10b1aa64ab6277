"""SHELL of the air: a process that makes the places of a network, and carries their packets.

It is started by `emulated.EmulatedNetwork`. It tells on its standard output at which of its open
files each place is, takes orders on its standard input, and leaves when that ends. With it goes
all that it has made.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Final

from quadriga.faults.network.layout import TEAM, NetworkLayout
from quadriga.faults.network.namespaces import inside, make_namespace, open_tun, run_ip
from quadriga.faults.network.order import RadioOrder
from quadriga.faults.network.radio import Arrivals, Radio
from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.scheduling import end_collection, take_priority
from quadriga.shared.runtime.signals import StopFlag, die_with_parent, stop_on_signals

_MTU: Final = 1500  # bytes, as of WLAN and Ethernet
_AT_ONCE: Final = 64  # packets that are read from one place before others have their turn
_LONGEST: Final = 0.1  # s, between two looks at the flag
_LINE: Final = 1 << 16  # bytes of orders that are read at once
_REFUSED: Final = 2  # exit status


def main() -> int:
    """Be the air until the standard input ends or a signal comes."""
    parser = argparse.ArgumentParser()
    for name in ("number", "seed", "parent"):
        parser.add_argument(name, type=int)
    parser.add_argument("robots", nargs="+")
    parser.add_argument("--wired", action="store_true")
    parser.add_argument("--rto-min-ms", type=int, default=0)
    given = parser.parse_args()
    stopped = stop_on_signals()
    die_with_parent(given.parent)
    layout = NetworkLayout(given.number, tuple(given.robots), given.wired, given.rto_min_ms)
    try:
        namespaces = make_places(layout)
        devices = {place: _join_air(layout, place, at) for place, at in namespaces.items()}
    except ProcessError as error:
        print(error, file=sys.stderr, flush=True)
        return _REFUSED
    end_collection()
    take_priority("realtime")  # an air that waits for its turn is a slow one
    held = {place: at for place, at in namespaces.items() if at is not None}
    print(json.dumps(held), flush=True)
    try:
        _Air(Radio(layout.hosts, given.seed), devices).carry(stopped)
    finally:
        remove_cables(layout)
    return 0


def make_places(layout: NetworkLayout) -> dict[str, int | None]:
    """The namespace of each place as an open file, joined by cables; None: the machine's own.

    Raises:
        ProcessError: the system does not permit it, or a network of this number is there already.
    """
    namespaces = {place: None if place == TEAM else make_namespace() for place in layout.places}
    for robot in layout.robots if layout.wired else ():
        _lay_cable(layout, robot, namespaces[robot])
    return namespaces


def remove_cables(layout: NetworkLayout) -> None:
    """Remove the ends of cables here; they would go with their other ends, but later."""
    for robot in layout.robots if layout.wired else ():
        with suppress(ProcessError):
            run_ip("link", "del", layout.cable(robot))


def _lay_cable(layout: NetworkLayout, robot: str, namespace: int | None) -> None:
    own, team = layout.address(robot), layout.address(TEAM)
    end, other = layout.cable(robot), "cable"
    there = f"/proc/{os.getpid()}/fd/{namespace}"
    run_ip("link", "add", end, "type", "veth", "peer", "name", other, "netns", there)
    run_ip("link", "set", end, "up")
    run_ip("address", "add", f"{team}/32", "dev", end)
    run_ip("route", "add", f"{own}/32", "dev", end, "src", team)
    with inside(namespace):
        run_ip("link", "set", other, "up")
        run_ip("address", "add", f"{own}/32", "dev", other)
        run_ip("route", "add", f"{team}/32", "dev", other, "src", own)


def _join_air(layout: NetworkLayout, place: str, namespace: int | None) -> int:
    device, address = layout.air(place), layout.address(place)
    with inside(namespace):
        tun = open_tun(device)
        run_ip("link", "set", device, "mtu", str(_MTU), "up")
        run_ip("address", "add", f"{address}/32", "dev", device)
        again = ("rto_min", f"{layout.rto_min_ms}ms") if layout.rto_min_ms else ()
        run_ip("route", "add", layout.subnet, "dev", device, "src", address, *again)
    return tun


class _Air:
    def __init__(self, radio: Radio, devices: Mapping[str, int]) -> None:
        self._radio, self._devices = radio, devices
        self._places = {device: place for place, device in devices.items()}
        self._orders = sys.stdin.fileno()
        self._rest = b""  # of a line of orders

    def carry(self, stopped: StopFlag) -> None:
        """Carry packets until there are no more orders, or it is stopped."""
        files = [self._orders, *self._places]
        while not stopped():
            wait = 1e-3 * self._radio.next_event - monotonic()
            # Its timeout is of microseconds, that of epoll of milliseconds.
            ready, _, _ = select.select(files, (), (), max(0.0, min(wait, _LONGEST)))
            now = 1e3 * monotonic()
            self._deliver(self._radio.arrivals(now))
            for file in ready:
                if file == self._orders:
                    if not self._obey(now):
                        return
                    continue
                packets = _read_packets(file)
                self._deliver(self._radio.send(self._places[file], packets, now))

    def _obey(self, now: float) -> bool:
        """Take in orders; False if there will be none any more."""
        read = os.read(self._orders, _LINE)
        *lines, self._rest = (self._rest + read).split(b"\n")
        for line in lines:
            self._radio.obey(RadioOrder.from_line(line.decode()), now)
        return bool(read)

    def _deliver(self, arrivals: Iterable[Arrivals]) -> None:
        for place, packets in arrivals:
            device = self._devices[place]
            for packet in packets:
                with suppress(OSError):  # it is full, or what arrives is no packet any more
                    os.write(device, packet)


def _read_packets(device: int) -> list[bytes]:
    packets = list[bytes]()
    try:
        while len(packets) < _AT_ONCE:
            packets.append(os.read(device, _MTU))
    except BlockingIOError:
        pass
    return packets


if __name__ == "__main__":
    sys.exit(main())
