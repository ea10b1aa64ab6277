"""What a process says when it is asked: the answers to questions, which are no topics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from quadriga.shared.members import DOCTOR
from quadriga.shared.messages import Message, plain
from quadriga.shared.runtime.record import record

# How far a process has come.
STARTED: Final = "started"  # it is on the bus and has not announced itself
HERE: Final = "here"  # it has, and waits until all have
WARMING_UP: Final = "warming-up"  # all have; it compiles and rehearses, or its robot stands up
READY: Final = "ready"  # it waits for the start, or walks
STAGES: Final = (STARTED, HERE, WARMING_UP, READY)

# How the system schedules it.
REALTIME: Final = "realtime"
ORDINARY: Final = "ordinary"
REFUSED: Final = "refused"  # a walk in real time needs it, and it does not get it


@dataclass(frozen=True, slots=True)
class Question:
    """What each process of a team can be asked, at any time, on a key of its own.

    Attributes:
        name: last part of the key.
        type: the answer's dataclass; its tick is 0, since it is of no tick.
        askers: who asks.
    """

    name: str
    type: type[Message]
    askers: tuple[str, ...]

    def key(self, team: str, process: str) -> str:
        """The Zenoh key on which a process answers; `process` may be `*`."""
        return f"{team}/{process}/{self.name}"


@record
class About(Message):
    """What a process says of itself when it is asked."""

    name: str = plain(str, "its name on the bus")
    host: str = plain(str, "the computer that it runs on")
    pid: int = plain(int, "its process id there")
    version: str = plain(str, "of quadriga; empty: not installed")
    code: str = plain(str, "digest of quadriga's source files")
    libraries: tuple[str, ...] = plain(
        list, "name and version of Python and of what it computes by"
    )
    config: tuple[str, ...] = plain(
        list, "section.key=value in JSON of all keys that a team shares; of long values a digest"
    )
    messages: tuple[str, ...] = plain(list, "name of each topic and digest of its messages' form")
    predictor: str = plain(str, "digest of its predictor; empty: none")
    stage: str = plain(str, "started, here, warming-up or ready")
    scheduling: str = plain(str, "realtime, ordinary or refused")
    sees: tuple[str, ...] = plain(list, "the others that it sees on the bus")
    wall_ns: int = plain(int, "its system clock [ns since 1970]")
    start_ns: int = plain(
        int, "when tick 0 begins by it, of the plant that drives time for others; 0: not yet [ns]"
    )


ABOUT: Final = Question("about", About, ("every process before the walk", DOCTOR))
QUESTIONS: Final = (ABOUT,)


def stage_of(reached: frozenset[str], *, met: bool) -> str:
    """How far a process has come that announced the stages `reached`; `met`: has seen all here."""
    if READY in reached:
        return READY
    if HERE not in reached:
        return STARTED
    return WARMING_UP if met else HERE


def scheduling_of(*, wanted: bool, granted: bool, stage: str) -> str:
    """How the system schedules a process, which asks for real time before it is ready."""
    if granted:
        return REALTIME
    return REFUSED if wanted and stage == READY else ORDINARY
