"""SHELL of a stop without haste: the team slows down and stands, and the walk may be over then."""

from __future__ import annotations

from typing import Final

from quadriga.agents.modes import DAMPING, ESTOP, STAND
from quadriga.shared import members
from quadriga.shared.config.sections import Config
from quadriga.shared.wire.codec import truncate_text
from quadriga.shared.wire.messages import SafeStop
from quadriga.shared.wire.topics import STOP
from quadriga.team.talk import Say, TeamTalk, keep_quiet

_PATIENCE: Final = 5.0  # s, in which the team stands
_END_PATIENCE: Final = 20.0  # s, in which the walk is over; a world may be slower than real time
_LONGEST_REASON: Final = 200  # characters; it becomes part of every agent's status


def stop_safely(
    config: Config, reason: str, *, ends: bool, tell: Say = keep_quiet
) -> tuple[bool, str]:
    """Have all robots slow down and stand.

    Args:
        config: the team's configuration.
        reason: told to every agent.
        ends: whether the walk is to be over then.
        tell: is told what is done, before what comes of it.

    Returns:
        Whether all stand, and the walk is over if it was to be; and what each robot does.

    Raises:
        BusError: the bus cannot be opened, or some agents or plants are not there: then nobody is
            told.
    """
    with TeamTalk(config, members.STOP, tell) as talk:
        say = talk.publisher(STOP)
        talk.await_all("stop")
        say(SafeStop(*talk.time, truncate_text(reason, _LONGEST_REASON), ends))
        asked = f"asked {', '.join(talk.agents)}; waiting until"
        if not ends:
            tell(f"{asked} all stand, at most {_PATIENCE:g} s")
            stands = talk.follow(lambda: talk.all_are(STAND, DAMPING, ESTOP), _PATIENCE)
            return stands, talk.describe()
        tell(f"{asked} the walk is over, at most {_END_PATIENCE:g} s")
        over = talk.follow(lambda: any(e.kind == "stop" for e in talk.events), _END_PATIENCE)
        end = "the walk is over" if over else f"the walk is not over after {_END_PATIENCE:g} s"
        return over, f"{talk.describe()}\n{end}"
