"""How a team is at one moment: the record that everything else here makes, judges or shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from quadriga.recordings.rates import RateFigures


@dataclass(frozen=True, slots=True)
class Costs:
    """What something cost each time since the last look: median, 99th percentile, maximum."""

    median: float
    p99: float
    max: float


@dataclass(frozen=True, slots=True)
class Account:
    """What a process has told of itself lately: of agents, plants and the planner.

    Attributes:
        mode, reason: as it says; a plant in real time has "realtime", the planner none.
        age_ms: how long ago it said so, by the wall clock.
        ages_ms: how old its inputs were, by name, world time.
        planner_ms: wall time of a planning step; None: it made none.
        tick_us: of a control tick, or by how much a plant's ticks were late; None: there was none.
        counters: events that it has counted since its start, by name.
    """

    mode: str
    reason: str
    age_ms: float
    ages_ms: Mapping[str, float] = field(default_factory=dict)
    planner_ms: Costs | None = None
    tick_us: Costs | None = None
    counters: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class MachineUse:
    """What a process takes of the computer that it runs on.

    Attributes:
        host: its computer.
        pid: its number there.
        cpu: share of one core since the last look; None: another computer's, or not known yet.
        memory: that it holds, bytes; None: another computer's.
    """

    host: str
    pid: int
    cpu: float | None = None
    memory: int | None = None


@dataclass(frozen=True, slots=True)
class MemberStatus:
    """One process of the team.

    Attributes:
        name: its name on the bus.
        here: whether it is there.
        health: "well", or why not: see `quadriga.doctor.health`.
        use: what it takes of its computer; None: it has not said where it runs.
        account: what it told of itself; None: nothing.
    """

    name: str
    here: bool
    health: str
    use: MachineUse | None = None
    account: Account | None = None


@dataclass(frozen=True, slots=True)
class TeamReading:
    """What messages tell of a team since the last look.

    Attributes:
        tick: how far the team's time has come, ms; −1: not known.
        pace: world time per wall time; None: it stands still, or is not known.
        accounts: by the name of the process.
        topics: of the keys that were listened to; what is lost since listening began.
        lost: by key how many messages did not come since the last look.
        late: by robot the share of commands that came too late, in real time.
        events: what happened last, one line each.
    """

    tick: int
    pace: float | None
    accounts: Mapping[str, Account]
    topics: tuple[RateFigures, ...]
    lost: Mapping[str, int]
    late: Mapping[str, float]
    events: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TeamStatus:
    """All of it.

    Attributes:
        team: its name.
        endpoint: where it is.
        linked: whether anybody is linked to who looks.
        reading: what its messages tell.
        members: its processes, in the order of the table of processes.
        problems: what is wrong, one line each.
    """

    team: str
    endpoint: str
    linked: bool
    reading: TeamReading
    members: tuple[MemberStatus, ...]
    problems: tuple[str, ...] = ()

    @property
    def is_well(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems
