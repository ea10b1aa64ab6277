"""Whether the processes of a team are healthy: they hear their peers, and all trust each other.

Pure. Presence alone is no health: a token of somebody who is not trusted passes a router's rules,
and one of a frozen process stays. Who is healthy answers by itself, through the router that knows
its certificate, with what it sees and has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from quadriga.shared.about import READY
from quadriga.shared.bus.diagnostics import BAD, CLOCK_OFF, TeamView, diagnose
from quadriga.shared.members import DOCTOR, ROUTER, Member

WELL: Final = "well"


def judge_team(team: Sequence[Member], view: TeamView) -> dict[str, str]:
    """By name `WELL`, or in a line why not, of all processes, the router and the doctor itself.

    Args:
        team: the processes.
        view: what the doctor sees of them.
    """
    reasons = {member.name: _find_reason(member, view) for member in team}
    reasons[ROUTER] = "" if view.linked else "the doctor has no link to it"
    found = {name: f"not well: {reason}" if reason else WELL for name, reason in reasons.items()}
    return {**found, DOCTOR: WELL}


def _find_reason(member: Member, view: TeamView) -> str:
    """Why a process is not healthy; "" if it is."""
    found = diagnose(member, view)
    # A clock has nothing to do with hearing and trusting each other.
    wrong = [item.text for item in found if item.verdict == BAD and item.code != CLOCK_OFF]
    about = view.about(member.name)
    if wrong or about is None:
        return ", ".join(wrong)
    if about.stage != READY:
        return ", ".join(item.text for item in found if item.code == about.stage)
    unheard = sorted(view.names - {member.name, *about.sees})
    return f"does not hear {', '.join(unheard)}" if unheard else ""
