"""The table of processes: their names on the bus, their roles and how they start and stop.

It imports nothing of the project, so that every module may ask it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

SIM: Final = "sim"  # steps the plant, which is a simulated world or a real robot
OPERATOR: Final = "operator"  # says how fast to walk where
RECORDER: Final = "recorder"
PLANNER: Final = "planner"  # plans for all robots, if one process does
AGENT: Final = "agent"  # one for each robot, whose name it has: r1 … rn

# On the bus too, but of no team: nobody waits for them.
ROUTER: Final = "router"
LAUNCHER: Final = "launcher"  # shows how far the walk has come
ESTOP: Final = "estop"  # stops the team once
STOP: Final = "stop"  # has the team slow down and stand, once
RESET: Final = "reset"  # releases an emergency stop, once
RESUME: Final = "resume"  # has a team that stands go on, once
SPEAKERS: Final = (ESTOP, STOP, RESET, RESUME)  # they see what comes of their word
DOCTOR: Final = "doctor"  # asks everybody how they are
OBSERVER: Final = "observer"  # whoever looks on: `echo`

# Who drives time, by name: the only plant, or that of the first robot. The others leave with it.
LEADS: Final = frozenset((SIM, "plant_r1"))


@dataclass(frozen=True, slots=True)
class Role:
    """One row of the table; its only process has its name, agents and plants see `team_members`.

    `command` is the subcommand of `quadriga` that is this process, `grace` how long it may take to
    leave once the walk is over or it is told to, s.
    """

    name: str
    command: str
    per_robot: bool = False
    predicts: bool = False
    grace: float = 12.0  # closing a session may take Zenoh ten seconds


# In the order in which they are started. The last is stopped when all others have left: it then
# has heard everything.
ROLES: Final = (
    Role(SIM, "sim"),
    Role(AGENT, "agent", per_robot=True, predicts=True),
    Role(PLANNER, "plan", predicts=True),
    Role(OPERATOR, "operate"),
    Role(RECORDER, "record", grace=20.0),
)
LAST: Final = ROLES[-1].name


@dataclass(frozen=True, slots=True)
class Member:
    """One process of a team, which all others wait for before they walk.

    `robot` is the one it is for, "" of a process that is for all; `foreign` tells that it is a
    controller of one's own, which need not answer who it is.
    """

    name: str
    role: Role
    robot: str = ""
    foreign: bool = False


def plant_name(robot: str) -> str:
    """The process that is the plant of one robot; with "" that of all robots."""
    return f"plant_{robot}" if robot else SIM


def has_lead(names: Collection[str]) -> bool:
    """Whether one of these processes drives the team's time."""
    return not LEADS.isdisjoint(names)


def team_members(
    robots: Sequence[str],
    *,
    central: bool,
    recorded: bool,
    plant_each: bool = False,
    foreign: bool = False,
) -> tuple[Member, ...]:
    """The processes of a team, in the order of the table.

    Args:
        robots: their names, which their agents have too.
        central: whether one process plans for all.
        recorded: whether the team waits for a recorder.
        plant_each: whether each robot has a plant of its own.
        foreign: whether the agents are controllers of one's own.
    """
    left_out = {PLANNER: not central, RECORDER: not recorded}
    members = list[Member]()
    for role in ROLES:
        if left_out.get(role.name):
            continue
        if role.per_robot:
            members += [Member(robot, role, robot, foreign) for robot in robots]
        elif role.name == SIM and plant_each:
            members += [Member(plant_name(robot), role, robot) for robot in robots]
        else:
            members.append(Member(role.name, role))
    return tuple(members)
