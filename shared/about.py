"""What a process says of itself when it is asked. This is no topic: only who asks hears it."""

from __future__ import annotations

from typing import Final

from quadriga.shared.messages import Message, plain
from quadriga.shared.runtime.record import record

# How far a process has come.
STARTED: Final = "started"  # it is on the bus and has not announced itself
HERE: Final = "here"  # it has, and waits until all have
WARMING_UP: Final = "warming-up"  # all have; it compiles and rehearses, or its robot stands up
READY: Final = "ready"  # it waits for the start, or walks
STAGES: Final = (STARTED, HERE, WARMING_UP, READY)


@record
class About(Message):
    """What a process says of itself; its tick is 0, since it is of no tick."""

    name: str = plain(str, "its name on the bus")
    host: str = plain(str, "the computer that it runs on")
    pid: int = plain(int, "its process id there")
    version: str = plain(str, "of quadriga; empty: not installed")
    code: str = plain(str, "digest of quadriga's source files")
    config: tuple[str, ...] = plain(
        list, "section.key=value in JSON of all keys that a team shares; of long values a digest"
    )
    messages: tuple[str, ...] = plain(list, "name of each topic and digest of its messages' form")
    predictor: str = plain(str, "digest of its predictor; empty: none")
    stage: str = plain(str, "started, here, warming-up or ready")
    sees: tuple[str, ...] = plain(list, "the others that it sees on the bus")
    wall_ns: int = plain(int, "its system clock [ns since 1970]")
    start_ns: int = plain(
        int, "when tick 0 begins by it, of the plant that drives time for others; 0: not yet [ns]"
    )


def about_key(team: str, process: str) -> str:
    """The key on which a process of a team is asked, and answers; `process` may be `*`."""
    return f"{team}/{process}/about"
