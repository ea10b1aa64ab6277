"""SHELL of the operator's release of an emergency stop: robots get up where they are, and stand."""

from __future__ import annotations

from typing import Final

from quadriga.shared import members
from quadriga.shared.codec import truncate_text
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Reset, Resume
from quadriga.shared.modes import STAND, WALK
from quadriga.shared.topics import RESET, RESUME
from quadriga.team.resume import PATIENCE
from quadriga.team.talk import Say, TeamTalk, keep_quiet

_UP: Final = 15.0  # s, in which robots have got up; a world may be slower than real time
_LONGEST_NAME: Final = 60  # characters; it becomes part of every agent's status


def reset_team(config: Config, by: str, *, stand: bool, tell: Say = keep_quiet) -> tuple[bool, str]:
    """Release an emergency stop; once all robots stand, have them go on unless they are to stay.

    Args:
        config: the team's configuration.
        by: who releases it.
        stand: whether the robots are to stay where they stand.
        tell: is told what is done, before what comes of it.

    Returns:
        Whether all robots do what was asked, and what each does.

    Raises:
        BusError: the bus cannot be opened, or some agents or plants are not there: then nobody is
            told.
    """
    with TeamTalk(config, members.RESET, tell) as talk:
        release, go_on = talk.publisher(RESET), talk.publisher(RESUME)
        talk.await_all("release")
        release(Reset(*talk.time, truncate_text(by, _LONGEST_NAME)))
        names = ", ".join(talk.agents)
        tell(f"release sent to {names}; waiting until all stand, at most {_UP:g} s")
        talk.statuses.clear()  # what came before the release says nothing
        stands = talk.follow(lambda: talk.all_are(STAND, WALK), _UP)
        if stand or not stands:
            return stands, talk.describe()
        go_on(Resume(*talk.time))
        tell(f"asked {names} to go on; waiting until all walk, at most {PATIENCE:g} s")
        walks = talk.follow(lambda: talk.all_are(WALK), PATIENCE)
        return walks, talk.describe()
