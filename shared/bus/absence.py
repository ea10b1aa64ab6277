"""Why a member of a team is not there, or not as it should be: from tokens and answers."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from quadriga.shared.bus.agreement import REFUSED, REMEDIES, TeamNorm, disagreements
from quadriga.shared.bus.diagnosis import BAD, GOOD, NOTE, Diagnosis
from quadriga.shared.members import SIM, Member
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

CLOCK_LIMIT: Final = 0.1  # s, by which wall clocks may differ: recordings are read by them
_STAGES: Final = {
    STARTED: (NOTE, "on the bus, has not announced itself yet"),
    HERE: (NOTE, "here, waits for the others"),
    WARMING_UP: (NOTE, "still warming up"),
    READY: (GOOD, "ready"),
}


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
    def clock_offset(self) -> tuple[float, float]:
        """How far its wall clock is ahead of the asker's, and how far that may be off, s."""
        if self.about is None:
            return 0.0, 0.0
        middle = (self.asked_ns + self.arrived_ns) // 2
        return 1e-9 * (self.about.wall_ns - middle), 5e-10 * (self.arrived_ns - self.asked_ns)


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
    """

    linked: bool
    here: frozenset[str]
    doubled: frozenset[str]
    names: frozenset[str]
    answers: Mapping[str, Sequence[MemberAnswer]] = field(default_factory=dict)
    norm: TeamNorm | None = None

    def about(self, name: str) -> About | None:
        """What a process has said of itself; of several of one name the one that is further."""
        said = [answer.about for answer in self.answers.get(name, ()) if answer.about is not None]
        return max(said, key=lambda about: STAGES.index(about.stage), default=None)


def diagnose(member: Member, view: TeamView) -> tuple[Diagnosis, ...]:
    """All there is to say of a member: why it is not there, or how far it is and what is wrong."""
    about = view.about(member.name)
    doubled = tuple(_two_of_a_name(member.name, view))
    if about is not None:
        return (*doubled, *_explain_stage(about, view), *_find_differences(about, view))
    return (*doubled, _explain_silence(member, view))


def describe_absent(absent: Collection[Member], view: TeamView) -> str:
    """Why some are not there, in one line: those of one reason together."""
    by_reason: dict[str, list[str]] = {}
    for member in absent:
        found = diagnose(member, view)
        wrong = [item for item in found if item.verdict == BAD] or found
        by_reason.setdefault(", ".join(item.text for item in wrong), []).append(member.name)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in by_reason.items())


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
    for answer in view.answers[about.name]:
        offset, error = answer.clock_offset
        if abs(offset) - error > CLOCK_LIMIT:
            text = f"its wall clock is {abs(offset):.3g} s {'ahead' if offset > 0 else 'behind'}"
            cause = "keep the clocks of all computers by NTP or PTP: `timedatectl set-ntp true`"
            yield Diagnosis(CLOCK_OFF, BAD, text, cause)
