"""Ticks that agents who are late in real time pass over: they send no command, and none is lost."""

from __future__ import annotations

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import MessageError
from quadriga.shared.robot.conventions import robot_names
from quadriga.shared.wire.codec import decode
from quadriga.shared.wire.messages import Consumed
from quadriga.shared.wire.topics import COMMAND, INPUTS


class PassedOver:
    """Finds in a team's messages which commands were never sent.

    Args:
        config: the team's configuration. In lock-step an agent has to answer every tick.
    """

    def __init__(self, config: Config) -> None:
        team = config.team.name
        names = robot_names(config.team.robots) if config.world.mode == "realtime" else ()
        self._commands = {INPUTS.key(team, name): COMMAND.key(team, name) for name in names}

    def find(self, key: str, payload: bytes) -> tuple[str, int] | None:
        """Key of the commands that an agent says it did not send, and how many of them.

        Args:
            key: of any message.
            payload: the message as sent.

        Returns:
            None of a message that says nothing about it, or that none was passed over.
        """
        command = self._commands.get(key)
        if command is None:
            return None
        try:
            passed = decode(payload, Consumed).passed
        except MessageError:
            return None
        return (command, passed) if passed > 0 else None
