"""Who of a team is missing, who is not as it should be, and why: from tokens and answers. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Final

from quadriga.shared.about import HERE, READY, STAGES, STARTED, WARMING_UP, About
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import LEADS, SIM, Member, team_members
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import robot_names

GOOD: Final = "good"
NOTE: Final = "note"  # worth knowing, and nothing is wrong
BAD: Final = "bad"
UNKNOWN: Final = "unknown"  # it could not be looked at

RECEIVE_BUFFER: Final = 4 << 20  # bytes, of each link's socket
CLOCK_OFF: Final = "clock-off"
CLOCK_LIMIT: Final = 0.1  # s, by which system clocks may differ: recordings are read by them
PACE_LIMIT: Final = 1e-3  # s, by which those of plants may that pace their robots by them
CLOCK_REMEDY: Final = "keep the clocks of all computers by PTP (ptp4l, phc2sys) or chrony"
_PACED: Final = {"team.plant_per_robot=true", 'world.mode="realtime"'}  # of the configuration
# In what processes may differ, and what to do about it. No team walks with any but other code.
_REMEDIES: Final = {
    "version": "install the same version of quadriga on all computers",
    "messages": "the versions are the same and the messages are not: install the same files",
    "configuration": "all processes of a team read the same file: copy it, give the same options",
    "predictor": "copy the predictor's file and name it with --predictor, or fit both by the same "
    "code",
    "code": "the versions are the same and the source files are not: update both",
}
_SHOWN: Final = 3  # keys that are named
_DIGITS: Final = 12  # of a digest
_STAGES: Final = {
    STARTED: (NOTE, "on the bus, has not announced itself yet"),
    HERE: (NOTE, "here, waits for the others"),
    WARMING_UP: (NOTE, "still warming up"),
    READY: (GOOD, "ready"),
}


def processes(config: Config) -> tuple[Member, ...]:
    """All processes of a team, in the order of the table of processes."""
    return team_members(
        robot_names(config.team.robots),
        central=find_kind(config.planner.kind).central,
        recorded=config.recorder.enabled,
        plant_each=config.team.plant_per_robot,
        foreign=bool(config.team.agent_command),
    )


def members(config: Config) -> frozenset[str]:
    """Names of all processes of a team."""
    return frozenset(member.name for member in processes(config))


def lead(config: Config) -> str:
    """Name of the process that drives the team's time, with which all others leave."""
    return next(member.name for member in processes(config) if member.name in LEADS)


def clock_difference(ahead: float, error: float, limit: float) -> str:
    """How far a clock differs from another, in words; "" if by no more than `limit`, or not surely.

    It is `ahead` of the other, which may be off by `error`; all in s.
    """
    if abs(ahead) - error <= limit:
        return ""
    return f"{1e3 * abs(ahead):,.1f} ms {'ahead of' if ahead > 0.0 else 'behind'}"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What came of one look at a process or a computer, for programs and in words.

    `verdict` is `GOOD`, `NOTE`, `BAD` or `UNKNOWN`; `remedy` is what to do about it, if anything.
    """

    code: str
    verdict: str
    text: str
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class MemberAnswer:
    """What one process has said of itself, None if it cannot be read.

    When it was asked and when the answer came is by the asker's wall clock, ns.
    """

    about: About | None
    asked_ns: int
    arrived_ns: int

    @property
    def clock_offset(self) -> tuple[float, float]:
        """How far its system clock is ahead of the asker's, and how far that may be off, s."""
        if self.about is None:
            return 0.0, inf
        middle, round_trip = (self.asked_ns + self.arrived_ns) // 2, self.arrived_ns - self.asked_ns
        return 1e-9 * (self.about.wall_ns - middle), 5e-10 * round_trip


@dataclass(frozen=True, slots=True)
class TeamView:
    """What one process sees of a team at one moment."""

    linked: bool  # whether it is linked to anybody at all
    here: frozenset[str]  # names of those that have announced themselves
    doubled: frozenset[str]  # names that two processes carry
    names: frozenset[str]  # all that the team should have
    # What was said, by name; processes of one name answer each.
    answers: Mapping[str, Sequence[MemberAnswer]] = field(default_factory=dict)
    # Who drives the team's time, with which all must agree; None: it has said nothing.
    lead: About | None = None

    @property
    def planner(self) -> About | None:
        """The first process by name that has told of a predictor; None: there is none."""
        told = (about for name in sorted(self.answers) for about in self.abouts(name))
        return next((about for about in told if about.predictor), None)

    def abouts(self, name: str) -> list[About]:
        """What the processes of a name have said of themselves, as far as it can be read."""
        return [said.about for said in self.answers.get(name, ()) if said.about is not None]

    def about(self, name: str) -> About | None:
        """What a process has said of itself; of several of one name the one that is further."""
        return max(self.abouts(name), key=lambda said: STAGES.index(said.stage), default=None)


def diagnose(member: Member, view: TeamView) -> tuple[Diagnosis, ...]:
    """All there is to say of a member: why it is not there, or how far it is and what is wrong."""
    about = view.about(member.name)
    found = [*_two_of_a_name(member.name, view)]
    if about is None:
        return (*found, _explain_silence(member, view))
    found += [*_explain_stage(about, view), *disagreements(about, view)]
    return (*found, *_compare_clocks(member, view))


def describe_absent(absent: Collection[Member], view: TeamView) -> str:
    """Why some are not there, in one line: those of one reason together."""
    by_reason: dict[str, list[str]] = {}
    for member in absent:
        found = diagnose(member, view)
        wrong = [item for item in found if item.verdict == BAD] or found
        by_reason.setdefault(", ".join(item.text for item in wrong), []).append(member.name)
    return "; ".join(f"{', '.join(names)}: {reason}" for reason, names in by_reason.items())


def disagreements(process: About, view: TeamView) -> Iterator[Diagnosis]:
    """In what a process differs from who drives time; of another version nothing else is compared.

    Predictors are compared with that of the first process that has one.
    """
    lead, planner = view.lead, view.planner
    if lead is None:
        return
    if process.version != lead.version:
        yield _differs("version", process.version, lead, lead.version)
        return
    for of, mine, theirs in (
        ("messages", process.messages, lead.messages),
        ("configuration", process.config, lead.config),
    ):
        if {*mine} != {*theirs}:
            got, wanted = _first_few({*mine} - {*theirs}), _first_few({*theirs} - {*mine})
            yield _differs(of, got, lead, wanted)
    if planner and process.predictor and process.predictor != planner.predictor:
        got, wanted = process.predictor[:_DIGITS], planner.predictor[:_DIGITS]
        yield _differs("predictor", got, planner, wanted)
    if process.code != lead.code:
        yield _differs("code", process.code, lead, lead.code)


def _differs(of: str, got: str, owner: About, wanted: str) -> Diagnosis:
    text = f"another {of}: {got or 'none'}, {owner.name} has {wanted or 'none'}"
    return Diagnosis(f"other-{of}", NOTE if of == "code" else BAD, text, _REMEDIES[of])


def refuse(name: str, team: str, found: Iterable[Diagnosis]) -> None:
    """Refuse process `name` of a team if it differs in what no team walks with.

    Raises:
        BusError: it does; the message names what, for instance the keys of the configuration.
    """
    for item in found:
        if item.verdict == BAD:
            expected = "the same in the whole team"
            raise BusError(f"{name} of team {team!r}", item.text, expected, item.remedy)


def _first_few(lines: Collection[str]) -> str:
    """Some of the lines, and how many more there are."""
    more = len(lines) - _SHOWN
    return ", ".join(sorted(lines)[:_SHOWN]) + (f" and {more} more" if more > 0 else "")


def _explain_silence(member: Member, view: TeamView) -> Diagnosis:
    name = member.name
    if view.answers.get(name):
        text = "says what this version cannot read"
        cause = "another version of quadriga: install the same one"
        return Diagnosis("unreadable", BAD, text, cause)
    if name in view.here:
        if member.foreign:
            text = "here, a controller of one's own that answers nothing"
            return Diagnosis("foreign", NOTE, text)
        cause = "frozen or overloaded, or an earlier version of quadriga: see its log, restart it"
        return Diagnosis("not-answering", BAD, "here, but does not answer", cause)
    seen_by = [n for n in sorted(view.answers) for said in view.abouts(n) if name in said.sees]
    if seen_by:
        text = f"seen by {', '.join(seen_by)}, but not from here"
        cause = "frozen, or in peer mode its bus.listen cannot be reached from here"
        return Diagnosis("not-reachable", BAD, text, cause)
    if not view.linked:
        return Diagnosis("no-link", BAD, "no link to anyone")  # the way there is another matter
    text = "not on the bus: not started, failed, or another bus.endpoint or team.name"
    robot = f" --robot {member.robot}" if member.robot else ""
    real = ", of a real robot `bridge`" if member.role.name == SIM else ""
    command = f"`quadriga {member.role.command}{robot}`{real}"
    return Diagnosis("not-started", BAD, text, f"start it ({command}), or look at what it said")


def _two_of_a_name(name: str, view: TeamView) -> Iterator[Diagnosis]:
    # A late recorder, which has not announced itself, is none.
    announced = [about for about in view.abouts(name) if about.stage != STARTED]
    if name in view.doubled or len(announced) > 1:
        where = " and ".join(f"{about.host}:{about.pid}" for about in announced)
        text = f"two processes of this name{f', {where}' if len(announced) > 1 else ''}"
        yield Diagnosis("two-of-a-name", BAD, text, "stop one, or give one team another name")


def _explain_stage(about: About, view: TeamView) -> Iterator[Diagnosis]:
    verdict, text = _STAGES[about.stage]
    missed = view.names - {about.name, *about.sees}
    if about.stage == HERE and missed:
        text = f"here, waits for {', '.join(sorted(missed))}"
    yield Diagnosis(about.stage, verdict, text)
    unseen = sorted(missed & view.here)
    if about.stage != STARTED and unseen:
        cause = "in peer mode bus.listen of each must be reachable for all others; a firewall?"
        yield Diagnosis("not-seen", BAD, f"does not see {', '.join(unseen)}", cause)


def _compare_clocks(member: Member, view: TeamView) -> Iterator[Diagnosis]:
    """That its system clock is off: against that of who drives time, or else this computer's."""
    lead = view.lead
    (behind, doubt), whose, limit = (0.0, 0.0), "this computer's", CLOCK_LIMIT
    if lead is not None and (led := view.answers.get(lead.name)):
        (behind, doubt), whose = led[0].clock_offset, f"that of {lead.name}"
        if member.role.name == SIM and _PACED.issubset(lead.config):
            limit = PACE_LIMIT
    for answer in view.answers[member.name]:
        ahead, error = answer.clock_offset
        if difference := clock_difference(ahead - behind, error + doubt, limit):
            text = f"its system clock is {difference} {whose}"
            yield Diagnosis(CLOCK_OFF, BAD, text, CLOCK_REMEDY)
