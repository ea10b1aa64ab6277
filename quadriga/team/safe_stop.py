"""SHELL of a stop without haste: the team slows down and stands, and the walk may be over then."""

from __future__ import annotations

from typing import Final

from quadriga.shared import members
from quadriga.shared.codec import truncate_text
from quadriga.shared.codes import STOP_ASKED
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import SafeStop
from quadriga.shared.modes import ESTOP, PASSIVE, STAND
from quadriga.shared.topics import STOP
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
        Whether who drives time has said that it was asked, all stand, and the walk is over if it
        was to be; and what each robot does.

    Raises:
        BusError: the bus cannot be opened, or some agents or plants are not there: then nobody is
            told.
    """
    with TeamTalk(config, members.STOP, tell) as talk:
        say = talk.publisher(STOP)
        talk.await_all("stop")
        talk.events.clear()
        say(SafeStop(*talk.time, truncate_text(reason, _LONGEST_REASON), ends))
        asked = f"asked {', '.join(talk.agents)}; waiting until"
        if not ends:
            tell(f"{asked} all stand, at most {_PATIENCE:g} s")
            stand = (STAND, PASSIVE, ESTOP)
            talk.follow(lambda: _is_heard(talk) and talk.all_are(*stand), _PATIENCE)
            return _is_heard(talk) and talk.all_are(*stand), talk.describe() + _doubt(talk)
        tell(f"{asked} the walk is over, at most {_END_PATIENCE:g} s")
        over = talk.follow(lambda: any(e.kind == "stop" for e in talk.events), _END_PATIENCE)
        end = "the walk is over" if over else f"the walk is not over after {_END_PATIENCE:g} s"
        return over and _is_heard(talk), f"{talk.describe()}\n{end}{_doubt(talk)}"


def _is_heard(talk: TeamTalk) -> bool:
    """Whether who drives time has said that the team was asked to stop."""
    return any(event.code == STOP_ASKED for event in talk.events)


def _doubt(talk: TeamTalk) -> str:
    """What is said where nobody has acknowledged the stop."""
    doubt = "nobody has said that it heard the stop: has the router denied it? `quadriga doctor`"
    return "" if _is_heard(talk) else f"\n{doubt}"
