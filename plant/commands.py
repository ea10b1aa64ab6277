"""Commands as they arrive at the world: decoded, checked, latest kept, the rest counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Final

import numpy as np

from quadriga.shared.errors import MessageError
from quadriga.shared.robot.conventions import N_JOINTS
from quadriga.shared.wire.codec import decode, encode
from quadriga.shared.wire.messages import Command
from quadriga.shared.wire.topics import COMMAND

MALFORMED: Final = "malformed"
STALE: Final = "stale"
FOREIGN: Final = "foreign"


class CommandBox:
    """The newest valid command of every robot, and what was refused.

    Attributes:
        latest: by robot, in no particular order.
        refused: number of refused messages by reason (`MALFORMED`, `STALE`, `FOREIGN`) and robot,
            "" for a robot of no or another team.
        last_error: the latest malformed message's error text, or "".
    """

    def __init__(self, team: str, names: Iterable[str]) -> None:
        self._robots = {COMMAND.key(team, name): name for name in names}
        self.latest: dict[str, Command] = {}
        self.refused: Counter[tuple[str, str]] = Counter()
        self.last_error = ""
        # The first one read compiles or loads the reader, which is not for the first tick.
        decode(encode(Command(0, 0, *np.zeros((5, N_JOINTS)))), Command)

    @property
    def malformed(self) -> int:
        """Number of packets that were not a valid command."""
        return sum(n for (reason, _), n in self.refused.items() if reason == MALFORMED)

    def tick_of(self, robot: str) -> int:
        """Tick of the robot's newest command, −1 before the first."""
        known = self.latest.get(robot)
        return -1 if known is None else known.tick

    def take(self, key: str, payload: bytes, tick: int, oldest: int) -> str:
        """Take in a packet at world time `tick`; the robot's name if its command is now newer.

        A command of the future, or of before `oldest`, is refused as stale.
        """
        robot = self._robots.get(key)
        if robot is None:
            self.refused[FOREIGN, ""] += 1
            return ""
        try:
            command = decode(payload, Command)
        except MessageError as error:
            self.refused[MALFORMED, robot] += 1
            self.last_error = str(error)
            return ""
        if not oldest <= command.tick <= tick or command.tick <= self.tick_of(robot):
            self.refused[STALE, robot] += 1
            return ""
        self.latest[robot] = command
        return robot
