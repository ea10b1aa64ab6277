"""SHELL of an emergency stop that is under way before the command line has been imported."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, Final, NamedTuple

from quadriga.drive.client import ControlLink
from quadriga.shared.errors import QuadrigaError

_REASON: Final = "--reason"
_STOPPED, _NOT_STOPPED = 0, 2
_HEARD_S: Final = 0.25  # in which an operator that is well says that it has heard the stop
_STOPPED_S: Final = 0.8  # in which it says what came of it; it gives the team 0.5 s
_FROZEN: Final = "its operator does not answer"


class QuickStop(NamedTuple):
    """What came of it.

    Attributes:
        status: exit status; None: the stop has to take the long way over the bus.
        options: which team that way is for, beside what was typed.
    """

    status: int | None
    options: tuple[str, ...] = ()


def stop_quickly(options: Sequence[str]) -> QuickStop:
    """Stop every team of this user on this machine, through their operators.

    Who is in a hurry does not say which of several. The long way is left where other options are
    given, where no team runs here, and for a team whose operator does not answer.

    Args:
        options: of `quadriga estop`.
    """
    if options and (len(options) != 2 or options[0] != _REASON):
        return QuickStop(None)
    from quadriga.drive.find import open_links

    reason, links = options[1] if options else "operator", open_links(patience=_HEARD_S)
    for link in links:  # all of them hear it before the first is asked what came of it
        with suppress(OSError):
            link.say("estop", text=reason)
    answers = [(link.team, _take_answer(link)) for link in links]
    for team, answer in answers:
        _tell(team, answer)
    silent = [team for team, answer in answers if answer is None]
    if not links or silent:
        return QuickStop(None, ("--team", silent[0]) if len(silent) == 1 else ())
    missing = any(answer["missing"] for _, answer in answers if answer is not None)
    return QuickStop(_NOT_STOPPED if missing else _STOPPED)


def _take_answer(link: ControlLink) -> dict[str, Any] | None:
    """What an operator says came of the stop; None if it says nothing that can be understood."""
    try:
        answer = link.await_stop(_STOPPED_S)
    except (QuadrigaError, OSError):
        return None
    finally:
        link.close()
    return answer if isinstance(answer.get("missing"), list) else None


def _tell(team: str, answer: dict[str, Any] | None) -> None:
    """Say what came of it, on standard error if some have not stopped."""
    if answer is not None and not answer["missing"]:
        what = "every joint is damped, until `quadriga reset`"
        print(f"team {team!r} stopped within {answer.get('ms')} ms: {what}", flush=True)
        return
    why = f"{_FROZEN}: over the bus now"
    if answer is not None:
        names = ", ".join(map(str, answer["missing"]))
        why = f"no word of {names} after {answer.get('ms')} ms; cut the power of a robot that moves"
    print(f"quadriga: emergency stop of team {team!r}: {why}", file=sys.stderr, flush=True)
