"""SHELL of an emergency stop that is under way before the command line has been imported."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Final

from quadriga.shared.errors import QuadrigaError

_REASON: Final = "--reason"
_STOPPED, _NOT_STOPPED = 0, 2


def stop_quickly(options: Sequence[str]) -> int | None:
    """Stop the only team on this machine through its operator; the exit status.

    Args:
        options: of `quadriga estop`.

    Returns:
        None if it is not that easy: other options are given, several teams run, none does, or the
        operator does not answer. Then the stop takes the long way over the bus.
    """
    if options and (len(options) != 2 or options[0] != _REASON):
        return None
    from quadriga.drive.find import open_link

    try:
        with open_link() as link:
            answer = link.ask("estop", text=options[1] if options else "operator")
    except (QuadrigaError, OSError):
        return None
    missing = answer.get("missing")
    if answer.get("kind") != "stopped" or not isinstance(missing, list):
        return None
    if missing:
        names = ", ".join(map(str, missing))
        print(
            f"quadriga: emergency stop: no word of {names} after {answer.get('ms')} ms; "
            "cut the power of a robot that moves",
            file=sys.stderr,
        )
        return _NOT_STOPPED
    print(f"stopped within {answer.get('ms')} ms: every joint is damped, until `quadriga reset`")
    return _STOPPED
