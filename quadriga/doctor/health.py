"""Whether the processes of a team are healthy: they hear their peers, and all trust each other.

Pure. Presence alone is no health: a token of somebody who is not trusted passes a router's rules,
and one of a frozen process stays. Who is healthy answers by itself, through the router that knows
its certificate, with what it sees and has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.shared.about import READY
from quadriga.shared.bus.diagnostics import BAD, CLOCK_OFF, NOT_REALTIME, TeamView, diagnose
from quadriga.shared.members import DOCTOR, ROUTER, Member

WELL: Final = "well"  # how the line of who is healthy begins
UNWELL: Final = "not well"
# What the doctor finds bad and has nothing to do with hearing and trusting each other.
_ELSE: Final = frozenset({CLOCK_OFF, NOT_REALTIME})


@dataclass(frozen=True, slots=True)
class Health:
    """How one process is, in a word or two.

    Attributes:
        name: of the process.
        reason: why it is not healthy; "": it is.
    """

    name: str
    reason: str = ""

    @property
    def line(self) -> str:
        """The same in one line, for programs and for people."""
        return f"{UNWELL}: {self.reason}" if self.reason else WELL


def judge_team(team: Sequence[Member], view: TeamView) -> tuple[Health, ...]:
    """The health of all processes, of the router and of the doctor itself.

    Args:
        team: the processes.
        view: what the doctor sees of them.
    """
    link = "" if view.linked else "the doctor has no link to it"
    found = (Health(member.name, _find_reason(member, view)) for member in team)
    return (*found, Health(ROUTER, link), Health(DOCTOR))


def _find_reason(member: Member, view: TeamView) -> str:
    """Why a process is not healthy; "" if it is."""
    found = diagnose(member, view)
    wrong = [item.text for item in found if item.verdict == BAD and item.code not in _ELSE]
    about = view.about(member.name)
    if wrong or about is None:
        return ", ".join(wrong)
    if about.stage != READY:
        return ", ".join(item.text for item in found if item.code == about.stage)
    unheard = sorted(view.names - {member.name, *about.sees})
    return f"does not hear {', '.join(unheard)}" if unheard else ""
