"""SHELL of the operator's word to go on, to robots that stand and may walk again."""

from __future__ import annotations

from typing import Final

from quadriga.agents.modes import REQUEST_MS
from quadriga.shared import members
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Resume
from quadriga.shared.modes import WALK
from quadriga.shared.topics import RESUME
from quadriga.team.talk import Say, TeamTalk, keep_quiet

PATIENCE: Final = 1e-3 * REQUEST_MS + 1.0  # s, in which robots that may go on do so


def resume_team(config: Config, tell: Say = keep_quiet) -> tuple[bool, str]:
    """Tell all robots to go on, and wait for those that may.

    Args:
        config: the team's configuration.
        tell: is told what is done, before what comes of it.

    Returns:
        Whether all of them walk, and what each does.

    Raises:
        BusError: the bus cannot be opened, or some agents are not there: then nobody is told.
    """
    with TeamTalk(config, members.RESUME, tell) as talk:
        say = talk.publisher(RESUME)
        talk.await_all("word to go on")
        say(Resume(*talk.time))
        tell(f"asked {', '.join(talk.agents)}; waiting until all walk, at most {PATIENCE:g} s")
        walks = talk.follow(lambda: talk.all_are(WALK), PATIENCE)
        return walks, talk.describe()
