"""How a bridge reaches its robot: what every kind of robot's driver offers."""

from __future__ import annotations

from collections import Counter
from typing import Protocol

from quadriga.shared.unitree.packets import MotorTargets, PacketError, RobotReport


def count_malformed(counters: Counter[str], error: PacketError) -> str:
    """Count a packet as malformed, and by its reason; what is wrong with it."""
    counters.update(("malformed", f"malformed_{error.reason}"))
    return str(error)


class RobotDriver(Protocol):
    """One robot on its own network.

    Attributes:
        servo: the motors' mode in which they follow commands.
        packets_ms: between two packets of the robot.
        period_ms: between two of its states that are used, and two commands.
        counters: packets by what became of them; "received" those that are good and new.
        malformed: what was wrong with the last packet that was no report; "" before the first.
        released: the robot's own controller that was asked to let go of the motors; "" if none.
    """

    servo: int
    packets_ms: int
    period_ms: int
    counters: Counter[str]
    malformed: str
    released: str

    def receive(self) -> RobotReport | None:
        """The newest report that has come since the last call; None if there is none."""
        ...

    def introduce(self) -> None:
        """Send one packet that enables no motor, if the robot reports to none but who sent one."""
        ...

    def send(self, targets: MotorTargets) -> None:
        """Send a command. A packet that cannot be sent is counted, not an error."""
        ...

    def other_writers(self) -> int:
        """How many others have commanded the motors since the last call, as far as is known."""
        ...

    def take_over(self) -> None:
        """Have the robot's own controller let go of the motors.

        Raises:
            BridgeError: it does not.
        """
        ...

    def close(self) -> None:
        """Leave the robot's network."""
        ...
