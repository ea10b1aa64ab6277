"""Who runs first: the processes that a robot's motors wait for go before ordinary ones."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event
from typing import Final

from quadriga.shared.errors import ConfigError

REALTIME: Final = "realtime"
ORDINARY: Final = "ordinary"
VARIABLE: Final = "QUADRIGA_PRIORITY"  # of the environment: what holds instead of the configuration
_PRIORITY: Final = 1  # of 99: before every ordinary process, after everything else of the system
_FIRST: Final = 2  # likewise, before those that walk
_NICE: Final = -15  # of -20 to 19: an ordinary process gets a thirtieth beside it
_AUTOGROUP: Final = Path("/proc/self/autogroup")  # "/autogroup-7 nice 0", see sched(7)
_left: Final = Event()  # set once this process has left its priority by itself


def take_priority(priority: str) -> bool:
    """Schedule all threads of this process round robin in real time, if `priority` is `REALTIME`.

    So a thread that wakes up does not push out one at work, which costs both their caches, and
    no other program delays a command. The system keeps a share (5 % on Linux) for ordinary
    processes. In real time the recorder stays one of them, see `precede_ordinary`, until it
    starves; in lock-step, where agents and world wait for nothing but each other, it would at once,
    and is scheduled like them.

    Args:
        priority: `runtime.priority`, unless the environment has `VARIABLE`.

    Returns:
        Whether it is so now: a user without the right (CAP_SYS_NICE, or an rtprio limit) is not
        refused, the process merely runs as an ordinary one.

    Raises:
        ConfigError: the environment's priority is none.
    """
    if not _is_realtime(priority):
        return False
    _left.clear()
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
    in real time. A user without the right (CAP_SYS_NICE) is not refused.

    Args:
        priority: as of `take_priority`; only `REALTIME` has an effect.
    """
    if _is_realtime(priority):
        for thread in _threads():
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, thread, _NICE)
        _weigh_session()


def _weigh_session() -> None:
    """Have this process's niceness hold against processes of other sessions, too.

    Where Linux groups processes by session (`kernel.sched_autogroup_enabled`, for who is in no
    control group of its own), each session gets the same share of the processors, and a process's
    niceness counts within its session alone. Here it becomes that of the session, if this process
    leads it: others in there are not its own.
    """
    with suppress(OSError):
        if os.getsid(0) == os.getpid():
            niceness = os.getpriority(os.PRIO_PROCESS, 0)
            _AUTOGROUP.write_text(str(niceness), encoding="ascii")


def leave_priority() -> None:
    """Schedule all threads of this process as ordinary ones: its work is done.

    What it still does, to leave, must not hold up others, such as bridges that lay a robot down.
    """
    if has_priority():
        _left.set()
    with suppress(OSError):
        _schedule(os.SCHED_OTHER, 0)


@contextmanager
def at_work(priority: str) -> Iterator[None]:
    """Within the block, this process has priority: see `take_priority`, `leave_priority`.

    Raises:
        ConfigError: the environment's priority is none.
    """
    take_priority(priority)
    try:
        yield
    finally:
        leave_priority()


def has_priority() -> bool:
    """Whether this process is scheduled in real time, or was until it left its priority."""
    if _left.is_set():
        return True
    return os.sched_getscheduler(os.getpid()) in (os.SCHED_RR, os.SCHED_FIFO)


def go_first(*, alone: bool = False) -> None:
    """Schedule this process before those that walk, if the user may do so: it is to stop them.

    Args:
        alone: what it starts from now on is ordinary.
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


def _is_realtime(priority: str) -> bool:
    return valid_priority(priority) == REALTIME


def _schedule(policy: int, level: int) -> None:
    for thread in _threads():
        with suppress(ProcessLookupError):  # it has ended meanwhile
            os.sched_setscheduler(thread, policy, os.sched_param(level))


def _threads() -> list[int]:
    return [int(thread.name) for thread in Path("/proc/self/task").iterdir()]


def count_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))
