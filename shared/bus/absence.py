"""Why a member of a team is not there, or not as it should be: from tokens and answers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from quadriga.shared.bus.agreement import REFUSED, REMEDIES, TeamNorm, disagreements
from quadriga.shared.bus.diagnosis import BAD, GOOD, NOTE, Diagnosis
from quadriga.shared.bus.distrust import EXPIRED, REVOKED, diagnose_refusals, diagnose_router
from quadriga.shared.members import SIM, Member
from quadriga.shared.security.past_refusals import PastRefusal
from quadriga.shared.wire.about import HERE, READY, STAGES, STARTED, WARMING_UP, About
from quadriga.shared.wire.about import REFUSED as NOT_GRANTED

NOT_STARTED: Final = "not-started"
NO_LINK: Final = "no-link"
NOT_ANSWERING: Final = "not-answering"
FOREIGN: Final = "foreign"
NOT_REACHABLE: Final = "not-reachable"
UNREADABLE: Final = "unreadable"
TWO_OF_A_NAME: Final = "two-of-a-name"
DIFFERS: Final = "other-"  # and what: `other-configuration`, see `shared.bus.agreement`
CLOCK_OFF: Final = "clock-off"
NOT_SEEN: Final = "not-seen"
NOT_REALTIME: Final = "not-realtime"

_REASONS_ENOUGH: Final = (REVOKED, EXPIRED)  # why a process is not on the bus
CLOCK_LIMIT: Final = 0.1  # s, by which system clocks may differ: recordings are read by them
PACE_LIMIT: Final = 1e-3  # s, by which those of plants may that pace their robots by them
CLOCK_REMEDY: Final = "keep the clocks of all computers by PTP (ptp4l, phc2sys) or chrony"
_PACED: Final = frozenset({'team.plants="each"', 'world.mode="realtime"'})  # of the configuration
_STAGES: Final = {
    STARTED: (NOTE, "on the bus, has not announced itself yet"),
    HERE: (NOTE, "here, waits for the others"),
    WARMING_UP: (NOTE, "still warming up"),
    READY: (GOOD, "ready"),
}


class ClockOffset(NamedTuple):
    """How far one system clock is ahead of another, and how far that may be off, s."""

    ahead: float
    error: float

    def __sub__(self, other: ClockOffset) -> ClockOffset:
        """The offset between two clocks that were both compared with a third."""
        return ClockOffset(self.ahead - other.ahead, self.error + other.error)

    def exceeds(self, limit: float) -> bool:
        """Whether the clocks differ by more than `limit` for sure."""
        return abs(self.ahead) - self.error > limit

    def __str__(self) -> str:
        size, direction = abs(self.ahead), "ahead of" if self.ahead > 0.0 else "behind"
        return f"{size:.3g} s {direction}" if size >= 1.0 else f"{1e3 * size:.3g} ms {direction}"


@dataclass(frozen=True, slots=True)
class MemberAnswer:
    """What one process has said of itself.

    Attributes:
        about: None: it cannot be read.
        asked_ns: when it was asked, by the asker's wall clock.
        arrived_ns: when the answer came, by the same clock.
    """

    about: About | None
    asked_ns: int
    arrived_ns: int

    @property
    def clock_offset(self) -> ClockOffset:
        """How far its system clock is ahead of the asker's; zeros if it cannot be read."""
        if self.about is None:
            return ClockOffset(0.0, 0.0)
        middle, round_trip = (self.asked_ns + self.arrived_ns) // 2, self.arrived_ns - self.asked_ns
        return ClockOffset(1e-9 * (self.about.wall_ns - middle), 5e-10 * round_trip)


@dataclass(frozen=True, slots=True)
class TeamView:
    """What one process sees of a team at one moment.

    Attributes:
        linked: whether it is linked to anybody at all.
        here: names of those that have announced themselves.
        doubled: names that two processes carry.
        answers: what was said, by name; processes of one name answer each.
        names: all that the team should have.
        norm: what all must agree with; None: unknown.
        refused: what the router has refused, the newest last; None: it ought to say and does not.
    """

    linked: bool
    here: frozenset[str]
    doubled: frozenset[str]
    names: frozenset[str]
    answers: Mapping[str, Sequence[MemberAnswer]] = field(default_factory=dict)
    norm: TeamNorm | None = None
    refused: tuple[PastRefusal, ...] | None = ()

    def about(self, name: str) -> About | None:
        """What a process has said of itself; of several of one name the one that is further."""
        said = [answer.about for answer in self.answers.get(name, ()) if answer.about is not None]
        return max(said, key=lambda about: STAGES.index(about.stage), default=None)


def diagnose(member: Member, view: TeamView) -> tuple[Diagnosis, ...]:
    """All there is to say of a member: why it is not there, or how far it is and what is wrong."""
    about = view.about(member.name)
    doubled = tuple(_two_of_a_name(member.name, view))
    refused = tuple(diagnose_refusals(member.name, view.refused, here=about is not None))
    if about is not None:
        stage, differs = _explain_stage(about, view), _find_differences(about, view)
        return (*doubled, *stage, *differs, *_compare_clocks(member, view), *refused)
    if any(item.code in _REASONS_ENOUGH for item in refused):
        return (*doubled, *refused)
    return (*doubled, *refused, _explain_silence(member, view))


def diagnose_nameless(view: TeamView) -> tuple[Diagnosis, ...]:
    """What the router says, or does not say, that is of no process in particular."""
    return tuple(diagnose_router(view.refused, complete=view.names <= {*view.answers}))


def describe_absent(absent: Collection[Member], view: TeamView) -> str:
    """Why some are not there, in one line: those of one reason together, the router's word last."""
    by_reason: dict[str, list[str]] = {}
    for member in absent:
        found = diagnose(member, view)
        wrong = [item for item in found if item.verdict == BAD] or found
        by_reason.setdefault(", ".join(item.text for item in wrong), []).append(member.name)
    reasons = [f"{', '.join(names)}: {reason}" for reason, names in by_reason.items()]
    return "; ".join((*reasons, *(item.text for item in diagnose_nameless(view))))


def _explain_silence(member: Member, view: TeamView) -> Diagnosis:
    name = member.name
    if view.answers.get(name):
        text = "says what this version cannot read"
        return Diagnosis(UNREADABLE, BAD, text, "another version of quadriga: install the same one")
    if name in view.here:
        if member.foreign:
            return Diagnosis(FOREIGN, NOTE, "here, a controller of one's own that answers nothing")
        cause = "frozen or overloaded, or an earlier version of quadriga: see its log, restart it"
        return Diagnosis(NOT_ANSWERING, BAD, "here, but does not answer", cause)
    witnesses = sorted(other for other in view.answers if name in _sees(view.about(other)))
    if witnesses:
        text = f"seen by {', '.join(witnesses)}, but not from here"
        cause = "frozen, or in peer mode its bus.listen cannot be reached from here"
        return Diagnosis(NOT_REACHABLE, BAD, text, cause)
    if not view.linked:
        return Diagnosis(NO_LINK, BAD, "no link to anyone")  # the way there is another matter
    text = "not on the bus: not started, failed, or another bus.endpoint or team.name"
    cause = f"start it ({_command_of(member)}), or look at what it said"
    return Diagnosis(NOT_STARTED, BAD, text, cause)


def _command_of(member: Member) -> str:
    robot = f" --robot {member.robot}" if member.robot else ""
    real = ", of a real robot `bridge`" if member.role.name == SIM else ""
    return f"`quadriga {member.role.command}{robot}`{real}"


def _sees(about: About | None) -> Collection[str]:
    return () if about is None else about.sees


def _two_of_a_name(name: str, view: TeamView) -> Iterator[Diagnosis]:
    answers = view.answers.get(name, ())
    said = [answer.about for answer in answers if answer.about is not None]
    members = [about for about in said if about.stage != STARTED]  # a late recorder is none
    if name not in view.doubled and len(members) < 2:
        return
    where = " and ".join(f"{about.host}:{about.pid}" for about in members)
    text = f"two processes of this name{f', {where}' if len(members) > 1 else ''}"
    yield Diagnosis(TWO_OF_A_NAME, BAD, text, "stop one of them, or give one team another name")


def _explain_stage(about: About, view: TeamView) -> Iterator[Diagnosis]:
    verdict, text = _STAGES[about.stage]
    missed = view.names - {about.name, *about.sees}
    if about.stage == HERE and missed:
        text = f"here, waits for {', '.join(sorted(missed))}"
    yield Diagnosis(about.stage, verdict, text)
    unseen = sorted(missed & view.here)
    if about.stage != STARTED and unseen:
        cause = "in peer mode bus.listen of each must be reachable for all others; a firewall?"
        yield Diagnosis(NOT_SEEN, BAD, f"does not see {', '.join(unseen)}", cause)
    if about.scheduling == NOT_GRANTED:
        cause = "permit it: LimitRTPRIO=1 in its unit, or rtprio 1 in /etc/security/limits.d"
        yield Diagnosis(NOT_REALTIME, BAD, "has no real-time scheduling", cause)


def _find_differences(about: About, view: TeamView) -> Iterator[Diagnosis]:
    for item in disagreements(about, view.norm) if view.norm else ():
        verdict = BAD if item.of in REFUSED else NOTE
        text = f"another {item.of}: {item.got}, {item.owner} has {item.wanted}"
        yield Diagnosis(f"{DIFFERS}{item.of}", verdict, text, REMEDIES[item.of])


def _compare_clocks(member: Member, view: TeamView) -> Iterator[Diagnosis]:
    """That its system clock is off: against this computer's, or by which plants pace robots."""
    leader = view.norm.lead if view.norm else None
    paces = member.role.name == SIM and leader is not None and _PACED.issubset(leader.config)
    led = [said.clock_offset for said in view.answers.get(leader.name, ())] if leader else []
    for answer in view.answers[member.name]:
        if answer.clock_offset.exceeds(CLOCK_LIMIT):
            text = f"its system clock is {answer.clock_offset} this computer's"
            yield Diagnosis(CLOCK_OFF, BAD, text, CLOCK_REMEDY)
        elif paces and led and (offset := answer.clock_offset - led[0]).exceeds(PACE_LIMIT):
            text = f"its system clock is {offset} that of the plant which drives time"
            yield Diagnosis(CLOCK_OFF, BAD, text, CLOCK_REMEDY)
