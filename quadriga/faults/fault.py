"""What a fault of a team is: how its walk is prepared, and what happens at its moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

from quadriga.shared.config.sections import Config
from quadriga.team.launch import Launch, ProcessSpec

REALTIME_ROBOTS: Final = 2  # at most: a computer of two cores keeps up with no more
OWN: Final = "robot"  # in place of a process: the agent of the robot that the seed draws


class Draw(NamedTuple):
    """What the seed has drawn for a walk.

    Attributes:
        robot: whom the fault meets, if it meets a robot or its agent.
        tick: world time of the fault, ms.
        seed: of the world; further chance is drawn from it.
        chosen: whether somebody has chosen the robot.
    """

    robot: str
    tick: int
    seed: int
    chosen: bool = False


@dataclass(slots=True)
class FaultScene:
    """A team that walks, as a fault finds it.

    Attributes:
        config: of the walk.
        draw: what the seed has drawn.
        folder: of the walk: configuration, logs, recording.
        launch: its processes.
        struck: processes that will not leave by themselves any more; they are killed at the end.
        facts: what the fault itself has to tell; they become fields of the row.
    """

    config: Config
    draw: Draw
    folder: Path
    launch: Launch
    struck: set[str] = field(default_factory=set)
    facts: dict[str, Any] = field(default_factory=dict)

    def name_of(self, process: str) -> str:
        """The name of a process, which is the drawn robot's in place of `OWN`."""
        return self.draw.robot if process == OWN else process


Strike: TypeAlias = Callable[[FaultScene], None]


def _unchanged(row: ProcessSpec) -> ProcessSpec:
    return row


class Stage(NamedTuple):
    """A walk that is prepared for a fault.

    Attributes:
        config: it is walked with this. In client mode a router is started with it.
        strike: is called at the fault's moment; None where the world itself makes the fault.
        wrap: each process is started as the row that this makes of its own.
        robot: whose agent or link the fault meets; "": no robot's in particular.
        detail: what the event of its beginning tells beside the fault's name.
        lasts: how long the fault goes on after `strike` has returned, s; None: it never ends.
    """

    config: Config
    strike: Strike | None = None
    wrap: Callable[[ProcessSpec], ProcessSpec] = _unchanged
    robot: str = ""
    detail: str = ""
    lasts: float | None = None


SetStage: TypeAlias = Callable[[Config, Draw, Path], AbstractContextManager[Stage]]
Lasting: TypeAlias = Callable[[float], SetStage]


@dataclass(frozen=True, slots=True)
class TeamFault:
    """One thing that goes wrong.

    Attributes:
        name: on the command line and in tables.
        what: in words.
        stage: prepares its walk: gets the configuration, what was drawn and the walk's folder.
            What it has set up it takes down on leaving.
        realtime: whether it is tried in real time, or in lock-step.
        given: whom it meets and at which tick, ms; None: the seed draws both, of "" the robot.
        lasting: the stage in which it lasts so many seconds; None: it lasts as its name says.
        base: the name in the table of one that is given; "": its own.
    """

    name: str
    what: str
    stage: SetStage
    realtime: bool = True
    given: tuple[str, int] | None = None
    lasting: Lasting | None = None
    base: str = ""


def robot_of(process: str, draw: Draw) -> str:
    """The robot of a process that a fault meets; "" of a process that is for all."""
    return draw.robot if process == OWN else ""


def strike_with(strike: Strike, process: str = "", lasts: float | None = None) -> SetStage:
    """The stage of a fault that needs no more than its moment.

    Args:
        strike: makes the fault.
        process: that it meets; `OWN` is the agent of the robot that is drawn.
        lasts: as of `Stage`.
    """

    @contextmanager
    def stage(config: Config, draw: Draw, _folder: Path) -> Iterator[Stage]:
        yield Stage(config, strike, robot=robot_of(process, draw), lasts=lasts)

    return stage
