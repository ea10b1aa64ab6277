"""Commands as they arrive at the world: decoded, checked, latest kept, the rest counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Final

import numpy as np

from quadriga.plant.command_limits import command_limits, describe_excess
from quadriga.shared.errors import MessageError
from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.robot.spec import RobotSpec
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Command
from quadriga.shared.wire.topics import COMMAND

MALFORMED: Final = "malformed"
IMPLAUSIBLE: Final = "implausible"
CONTRADICTED: Final = "contradicted"
STALE: Final = "stale"
FOREIGN: Final = "foreign"
_INVALID: Final = (MALFORMED, IMPLAUSIBLE, CONTRADICTED)  # no process of this project sends such


class CommandBox:
    """The newest valid command of every robot, and what was refused.

    Attributes:
        latest: by robot, in no particular order.
        refused: number of refused messages by reason (`MALFORMED`, `IMPLAUSIBLE`, `CONTRADICTED`,
            `STALE`, `FOREIGN`) and robot, "" for a robot of no or another team.
        errors: by robot, what was wrong with the latest that no process of this project sends.
    """

    def __init__(self, team: str, names: Iterable[str], robot: RobotSpec) -> None:
        """Of the robots `names` of a team, all of the kind `robot`."""
        self._robots = {COMMAND.key(team, name): name for name in names}
        self._limits = command_limits(robot)
        self.latest: dict[str, Command] = {}
        self.refused: Counter[tuple[str, str]] = Counter()
        self.errors: dict[str, str] = {}
        self._whys: dict[str, str] = {}  # why each robot's latest command was refused
        # The first one read compiles or loads what reads it, which is not for the first tick.
        first = decode(encode(Command(0, 0, *np.zeros((5, N_JOINTS)))), Command)
        describe_excess(first, self._limits)

    def invalid_of(self, robot: str) -> int:
        """Number of a robot's packets that were no valid command, or one that nobody can mean."""
        return sum(self.refused[reason, robot] for reason in _INVALID)

    def tick_of(self, robot: str) -> int:
        """Tick of the robot's newest command, −1 before the first."""
        known = self.latest.get(robot)
        return -1 if known is None else known.tick

    def why_refused(self, robot: str) -> str:
        """What was wrong with the robot's latest command; "" if it counts, or there is none."""
        return self._whys.get(robot, "")

    def take(self, key: str, payload: bytes, tick: int, oldest: int) -> str:
        """Take in a packet; the robot's name if its command is now newer.

        Refused are a command with numbers beyond `command_limits`, and as stale one of a tick
        before `oldest` or after `tick`, the newest of which the robots' states are published. Of
        two commands of one tick the first counts: the plant cannot know which of them is meant.
        That they differ is told.
        """
        robot = self._robots.get(key)
        if robot is None:
            self.refused[FOREIGN, ""] += 1
            return ""
        try:
            command = decode(payload, Command)
        except MessageError as error:
            return self._refuse(MALFORMED, robot, str(error))
        known = self.latest.get(robot)
        if known is not None and command.tick == known.tick:
            if command.row.tobytes() == known.row.tobytes():
                return self._refuse(STALE, robot)
            differ = f"command: got two of tick {command.tick} for {robot}, expected one"
            return self._refuse(CONTRADICTED, robot, f"{differ} (does someone else command it?)")
        first = max(oldest, self.tick_of(robot) + 1)
        if not first <= command.tick <= tick:
            wanted = f"{first} … {tick}" if first < tick else f"{first}"
            self._whys[robot] = f"command.tick: got {command.tick}, expected {wanted}"
            return self._refuse(STALE, robot)
        excess = describe_excess(command, self._limits)
        if excess:
            return self._refuse(IMPLAUSIBLE, robot, excess)
        self.latest[robot] = command
        self._whys.pop(robot, None)
        return robot

    def _refuse(self, reason: str, robot: str, error: str = "") -> str:
        """Count a packet; no robot has a newer command by it."""
        self.refused[reason, robot] += 1
        if error:
            self.errors[robot] = self._whys[robot] = error
        return ""
