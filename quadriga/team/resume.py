"""SHELL of the operator's word to go on, to robots that stand and may walk again."""

from __future__ import annotations

from typing import Final

from quadriga.agents.healing import WORD_MS
from quadriga.agents.modes import WALK
from quadriga.shared import members
from quadriga.shared.config.sections import Config
from quadriga.shared.wire.messages import Resume
from quadriga.shared.wire.topics import RESUME
from quadriga.team.talk import TeamTalk

PATIENCE: Final = 1e-3 * WORD_MS + 1.0  # s, in which robots that may go on do so


def resume_team(config: Config) -> tuple[bool, str]:
    """Tell all robots to go on, and wait for those that may.

    Returns:
        Whether all of them walk, and what each does.

    Raises:
        BusError: the bus cannot be opened, or some agents are not there: then nobody is told.
    """
    with TeamTalk(config, members.RESUME) as talk:
        say = talk.publisher(RESUME)
        talk.await_all("word to go on")
        say(Resume(*talk.time))
        walks = talk.follow(lambda: talk.all_are(WALK), PATIENCE)
        return walks, talk.describe()
