"""Who of a team is missing, who is not as it should be, and why: from tokens and answers. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from quadriga.shared.about import HERE, READY, STAGES, STARTED, WARMING_UP, About
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import BusError
from quadriga.shared.members import LEADS, PLANNER, SIM, Member, team_members
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


def first_predicting(config: Config) -> str:
    """Name of the first process that plans with a predictor; "" if none does."""
    kind = find_kind(config.planner.kind)
    if not kind.needs_predictor:
        return ""
    return PLANNER if kind.central else robot_names(config.team.robots)[0]


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
        names: all that the team should have.
        answers: what was said, by name; processes of one name answer each.
        lead: who drives the team's time, with which all must agree; None: it has said nothing.
        planner: the first process that plans with a predictor, likewise.
    """

    linked: bool
    here: frozenset[str]
    doubled: frozenset[str]
    names: frozenset[str]
    answers: Mapping[str, Sequence[MemberAnswer]] = field(default_factory=dict)
    lead: About | None = None
    planner: About | None = None

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

    Predictors are compared with the first process that plans, where both have one.
    """
    lead, planner = view.lead, view.planner
    if lead is None:
        return
    if process.version != lead.version:
        yield _differs("version", process.version, lead, lead.version)
        return
    for of, mine, theirs in (
        ("messages", _by_name(process.messages, " "), _by_name(lead.messages, " ")),
        ("configuration", _by_name(process.config, "="), _by_name(lead.config, "=")),
    ):
        names = [name for name in sorted({*mine, *theirs}) if mine.get(name) != theirs.get(name)]
        if names:
            yield _differs(of, _name_values(names, mine), lead, _name_values(names, theirs))
    if planner and process.predictor and planner.predictor not in ("", process.predictor):
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


def _by_name(lines: Iterable[str], separator: str) -> dict[str, str]:
    split = (line.partition(separator) for line in lines)
    return {name: value for name, _, value in split}


def _name_values(names: list[str], values: Mapping[str, str]) -> str:
    """Some of the values, with their names, and how many more there are."""
    named = [f"{name} {values.get(name, 'unknown')}" for name in names[:_SHOWN]]
    more = len(names) - len(named)
    return ", ".join(named) + (f" and {more} more" if more else "")


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
    witnesses = sorted(
        other for other in view.answers if (said := view.about(other)) and name in said.sees
    )
    if witnesses:
        text = f"seen by {', '.join(witnesses)}, but not from here"
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
    """That its system clock is off: against this computer's, or by which plants pace robots."""
    lead = view.lead
    paces = member.role.name == SIM and lead is not None and _PACED.issubset(lead.config)
    led = [said.clock_offset for said in view.answers.get(lead.name, ())] if lead else []
    for answer in view.answers[member.name]:
        if answer.clock_offset.exceeds(CLOCK_LIMIT):
            text = f"its system clock is {answer.clock_offset} this computer's"
            yield Diagnosis(CLOCK_OFF, BAD, text, CLOCK_REMEDY)
        elif paces and led and (offset := answer.clock_offset - led[0]).exceeds(PACE_LIMIT):
            text = f"its system clock is {offset} that of the plant which drives time"
            yield Diagnosis(CLOCK_OFF, BAD, text, CLOCK_REMEDY)
