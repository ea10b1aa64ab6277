"""A simulated robot's board: from the world's messages to packets, and back.

Like a real one it has no watchdog: while no packet comes, its motors go on with the last command.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Final, Protocol

import numpy as np

from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.unitree.packets import NO_ANGLE, MotorTargets, PacketCodec, PacketError
from quadriga.shared.wire.messages import Command, State
from quadriga.sim_server.native.condition import RobotCondition
from quadriga.sim_server.native.link import NO_FAULTS, Link, Parcel

COMMANDS, REPORTS = "commands", "reports"  # the two directions of a robot's network
_LINKS, _CONDITION, _INTRUDER = {COMMANDS: 0, REPORTS: 1}, 2, 3  # streams of a robot's seed
_DAMPING: Final = 2.0  # N·m·s/rad, that a second writer asks for


class Intruder(Protocol):
    """Somebody else who sends commands to a robot."""

    def write(self, packet: bytes, /) -> bool:
        """Send a command; whether the system took it."""
        ...

    def close(self) -> None:
        """Leave."""
        ...


class Board(ABC):
    """What the boards of all kinds of robots do alike.

    Attributes:
        period_ms: between two reports.
        condition: of the robot: switched off, battery, remote control.
        malformed: packets that were no commands.
        received: commands.

    Args:
        codec: of its packets.
        servo: mode of a motor that follows its command.
        seed: of its chance.
        keeps_size: whether its network carries packets of one size only.
    """

    period_ms: int

    def __init__(
        self, codec: PacketCodec, servo: int, seed: Sequence[int], *, keeps_size: bool
    ) -> None:
        self._codec, self._servo = codec, servo
        self._links = {
            way: Link((*seed, stream), keeps_size=keeps_size) for way, stream in _LINKS.items()
        }
        self._inwards, self._outwards = self._links[COMMANDS], self._links[REPORTS]
        self.condition = RobotCondition((*seed, _CONDITION))
        self._targets: MotorTargets | None = None
        self._intruder: Intruder | None = None
        self._intruder_chance = np.random.default_rng((*seed, _INTRUDER))
        self._intruder_waits = False
        self._now = 0  # ms
        self.malformed = 0
        self.received = 0

    def report(self, state: State, heat: Array) -> None:
        """Send what is due at a tick: what the robot measures, at its rate.

        Args:
            state: what its sensors measure.
            heat: of its motors, (12,), 1 where continuous torque leads.
        """
        self._now = state.tick
        due = state.tick % self.period_ms == 0
        if self._intruder is not None and due:
            # Sometimes before the bridge's command of this tick, sometimes behind it.
            self._intruder_waits = bool(self._intruder_chance.integers(2))
            if not self._intruder_waits:
                self._write_as_intruder()
        if self.condition.off:
            return
        parcels: Sequence[Parcel] = ()
        if due:
            report = self.condition.report(state, heat, self._targets)
            parcels = (Parcel(self._codec.encode_report(report)),)
        for parcel in self._outwards.pass_on(parcels, self._now):
            self._send(parcel.packet)
        if due:
            self._serve()

    def obey(self) -> Command | None:
        """The command that the motors follow now; None: they are off, and brake."""
        if self._intruder_waits:
            self._intruder_waits = False
            self._write_as_intruder()
        parcels = self._inwards.pass_on(tuple(self._take()), self._now)
        if self.condition.off:
            return None
        for parcel in parcels:
            try:
                targets = self._codec.decode_command(parcel.packet)
            except PacketError:
                self.malformed += 1
                continue
            self.received += 1
            self._take_note(parcel)
            if self._listens():
                self._targets = targets
        return self.condition.command(self._targets)

    def disturb(self, fault: str, value: float, ways: Iterable[str]) -> None:
        """Set one of `LinkFaults` on the way of commands, of reports or of both."""
        for way in ways:
            faults = replace(self._links[way].faults, **{fault: value})
            self._links[way].faults = NO_FAULTS if faults == NO_FAULTS else faults

    def switch(self, *, on: bool) -> None:
        """Switch the robot on, or off: then nothing comes from it, and its motors brake."""
        if on:
            self.condition.switch_on(self._now)
        elif not self.condition.off:
            self.condition.off = True
            for link in self._links.values():
                link.forget()
            self._boot()

    def intrude(self, *, there: bool) -> None:
        """Have somebody else send harmless commands to the robot at its rate, or no more.

        Raises:
            BridgeError: there is no port for it.
        """
        if there and self._intruder is None:
            self._intruder = self._open_intruder()
        elif not there and self._intruder is not None:
            self._intruder.close()
            self._intruder = None

    def clear(self) -> None:
        """End all faults."""
        for link in self._links.values():
            link.faults = NO_FAULTS
        self.intrude(there=False)
        self.condition.clear(self._now)

    def close(self) -> None:
        """Leave the network."""
        self.intrude(there=False)
        self._close()

    def _boot(self) -> None:
        """Forget what a robot that is switched off forgets."""
        self._targets = None

    def _take_note(self, parcel: Parcel) -> None:
        """A command has come in this parcel."""
        return

    def _listens(self) -> bool:
        """Whether commands reach the motors."""
        return True

    def _serve(self) -> None:
        """Answer whatever else is asked of it."""
        return

    def _write_as_intruder(self) -> None:
        """Send a command that does no harm, as somebody else."""
        if self._intruder is None:
            return
        zero = np.zeros(N_JOINTS)
        harmless = MotorTargets(
            mode=np.full(N_JOINTS, self._servo, np.uint8),
            q=np.full(N_JOINTS, NO_ANGLE),
            dq=zero,
            tau=zero,
            kp=zero,
            kd=np.full(N_JOINTS, _DAMPING),
        )
        self._intruder.write(self._codec.encode_command(harmless))

    @abstractmethod
    def _send(self, packet: bytes) -> None:
        """Put a report on the network."""

    @abstractmethod
    def _take(self) -> Iterable[Parcel]:
        """What has come from the network, oldest first."""

    @abstractmethod
    def _open_intruder(self) -> Intruder: ...

    @abstractmethod
    def _close(self) -> None: ...
