"""SHELL of an emergency stop that is under way before the command line has been imported."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any, Final

from quadriga.shared.errors import QuadrigaError

_REASON: Final = "--reason"
_STOPPED, _NOT_STOPPED = 0, 2


def stop_quickly(options: Sequence[str]) -> int | None:
    """Stop every team of this user on this machine, through their operators; the exit status.

    Who is in a hurry does not say which of several.

    Args:
        options: of `quadriga estop`.

    Returns:
        None if it is not that easy: other options are given, no team runs here, or an operator
        does not answer. Then the stop takes the long way over the bus.
    """
    if options and (len(options) != 2 or options[0] != _REASON):
        return None
    from quadriga.drive.find import open_links

    reason, links = options[1] if options else "operator", open_links()
    try:
        for link in links:  # all of them hear it before the first is asked what came of it
            link.say("estop", text=reason)
        answers = [link.answer() for link in links]
    except (QuadrigaError, OSError):
        return None
    finally:
        for link in links:
            link.close()
    missing = [answer.get("missing") for answer in answers]
    if not answers or not all(isinstance(names, list) for names in missing):
        return None
    for link, answer in zip(links, answers, strict=True):
        _tell(link.team, answer)
    return _NOT_STOPPED if any(missing) else _STOPPED


def _tell(team: str, answer: dict[str, Any]) -> None:
    """Say what came of it, on standard error if some have not stopped."""
    names, ms = ", ".join(map(str, answer["missing"])), answer.get("ms")
    if names:
        print(
            f"quadriga: emergency stop of team {team!r}: no word of {names} after {ms} ms; "
            "cut the power of a robot that moves",
            file=sys.stderr,
        )
        return
    print(f"team {team!r} stopped within {ms} ms: every joint is damped, until `quadriga reset`")
