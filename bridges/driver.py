"""How a bridge reaches its robot: what every kind of robot's driver offers."""

from __future__ import annotations

from collections import Counter
from typing import Protocol

from quadriga.shared.unitree.packets import MotorTargets, RobotReport


class RobotDriver(Protocol):
    """One robot on its own network.

    Attributes:
        servo: the motors' mode in which they follow commands.
        packets_ms: between two packets of the robot.
        period_ms: between two of its states that are used, and two commands.
        counters: packets by what became of them; "received" those that are good and new.
        own_guards: guards of this bridge, which are no other writers.
        released: the robot's own controller that has let go of the motors; "" if none had to.
    """

    servo: int
    packets_ms: int
    period_ms: int
    counters: Counter[str]
    own_guards: int
    released: str

    def receive(self) -> RobotReport | None:
        """The newest report that has come since the last call; None if there is none."""
        ...

    def send(self, targets: MotorTargets) -> None:
        """Send a command. A packet that cannot be sent is counted, not an error."""
        ...

    def other_writers(self) -> int:
        """How many others command the motors, as far as it can be known."""
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
