"""Who runs first, and when garbage is collected: a tick has a millisecond."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from quadriga.shared.errors import ConfigError

REALTIME: Final = "realtime"
ORDINARY: Final = "ordinary"
VARIABLE: Final = "QUADRIGA_PRIORITY"  # of the environment: what holds instead of the configuration
_PRIORITY: Final = 1  # of 99: before every ordinary process, after everything else of the system
_FIRST: Final = 2  # likewise, before those that walk
_NICE: Final = -15  # of -20 to 19: an ordinary process gets a thirtieth beside it


def take_priority(priority: str) -> bool:
    """Schedule all threads of this process round robin in real time, if `priority` is `REALTIME`.

    So no other program delays a command; the system keeps a share (5 % on Linux) for ordinary
    processes. In real time the recorder stays one of them, see `precede_ordinary`, until it
    starves; in lock-step it would at once, and is scheduled like the others.

    Args:
        priority: `runtime.priority`, unless the environment has `VARIABLE`.

    Returns:
        Whether it is so now: a user without the right (CAP_SYS_NICE, or an rtprio limit) is not
        refused, the process merely runs as an ordinary one.

    Raises:
        ConfigError: the environment's priority is none.
    """
    if valid_priority(priority) != REALTIME:
        return False
    try:
        _schedule(os.SCHED_RR, _PRIORITY)
    except OSError as error:
        print(
            f"no real-time scheduling ({error.strerror}): this process runs as an ordinary one; "
            "`USER - rtprio 1` in /etc/security/limits.d, or LimitRTPRIO=1 in its unit, permits it",
            file=sys.stderr,
        )
        return False
    return True


def precede_ordinary(priority: str) -> None:
    """Give all threads of this process more of the processors than other ordinary ones get.

    For who must neither hold up those that walk nor starve because others compute: the recorder
    in real time. Only `REALTIME` has an effect, and only if the user has the right.
    """
    if valid_priority(priority) == REALTIME:
        for thread in _threads():
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, thread, _NICE)


def leave_priority() -> None:
    """Schedule all threads of this process as ordinary ones: its work is done.

    What it still does, to leave, must not hold up others, such as bridges that lay a robot down.
    """
    with suppress(OSError):
        _schedule(os.SCHED_OTHER, 0)


@contextmanager
def at_work(priority: str) -> Iterator[None]:
    """Within the block, this process has priority: see `take_priority`, `leave_priority`."""
    take_priority(priority)
    try:
        yield
    finally:
        leave_priority()


def go_first(*, alone: bool = False) -> None:
    """Schedule this process before those that walk, if the user may do so: it is to stop them.

    What it starts from now on is ordinary if it goes `alone`.
    """
    with suppress(OSError):
        _schedule(os.SCHED_RR | os.SCHED_RESET_ON_FORK * alone, _FIRST)


def valid_priority(priority: str) -> str:
    """The priority that holds: the environment's, or this one of the configuration.

    Raises:
        ConfigError: the environment's is none.
    """
    found = os.environ.get(VARIABLE, priority)
    if found not in (REALTIME, ORDINARY):
        expected = f"{REALTIME} or {ORDINARY}, or that it is not set"
        raise ConfigError(f"{VARIABLE} of the environment", repr(found), expected)
    return found


def _schedule(policy: int, level: int) -> None:
    for thread in _threads():
        with suppress(ProcessLookupError):  # it has ended meanwhile
            os.sched_setscheduler(thread, policy, os.sched_param(level))


def _threads() -> list[int]:
    return [int(thread.name) for thread in Path("/proc/self/task").iterdir()]


def count_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def end_collection() -> None:
    """No garbage collection from now on, which costs more than a tick; what there is now stays."""
    gc.freeze()
    gc.disable()


@contextmanager
def collector_off() -> Iterator[None]:
    """No garbage collection within the block."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
