"""A simulated A1 or Go1 on the network: it reports and obeys once it has had a command."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from quadriga.shared.unitree.packets import SERVO
from quadriga.shared.unitree.udp import UdpCodec
from quadriga.shared.unitree.udp_port import Address, UdpPort
from quadriga.sim_server.native.board import Board, Intruder
from quadriga.sim_server.native.link import Parcel


class UdpRobot(Board):
    """One robot's board. It reports to whoever commanded it last, and to nobody before.

    Args:
        codec: of its packets.
        here: where it takes commands.
        seed: of its chance.

    Raises:
        BridgeError: the port is taken.
    """

    period_ms = 1

    def __init__(self, codec: UdpCodec, here: Address, seed: Sequence[int] = (0,)) -> None:
        super().__init__(codec, SERVO, seed, keeps_size=False)
        self._here, self._port = here, UdpPort(here)
        self._listener: Address | None = None

    def _send(self, packet: bytes) -> None:
        self._port.send(packet, self._listener)  # to nobody, nothing

    def _take(self) -> Iterator[Parcel]:
        return (Parcel(packet, sender) for packet, sender in self._port.drain())

    def _take_note(self, parcel: Parcel) -> None:
        if parcel.sender is not None:
            self._listener = Address(*parcel.sender)

    def _open_intruder(self) -> Intruder:
        return _UdpIntruder(self._here)

    def _boot(self) -> None:
        super()._boot()
        self._listener = None

    def _close(self) -> None:
        self._port.close()


class _UdpIntruder:
    """A socket of its own that sends to a robot."""

    def __init__(self, robot: Address) -> None:
        self._port = UdpPort(Address(robot.host, 0), robot)

    def write(self, packet: bytes, /) -> bool:
        """See `Intruder`."""
        return self._port.send(packet)

    def close(self) -> None:
        """See `Intruder`."""
        self._port.close()
