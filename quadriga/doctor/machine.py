"""Whether a computer is fit for its part of a team: pure checks over what was read of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from packaging.requirements import InvalidRequirement, Requirement

from quadriga.shared.bus.diagnostics import (
    BAD,
    CLOCK_LIMIT,
    CLOCK_REMEDY,
    GOOD,
    NOTE,
    RECEIVE_BUFFER,
    UNKNOWN,
    Diagnosis,
    processes,
)
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR, RECORDER

_PROCESS_BYTES: Final = 400_000_000  # of memory that a process takes, at most
_ROBOT_BYTES: Final = 400_000  # recorded of a robot in a second of a walk, at most
_LEAST_DISK: Final = 200_000_000  # bytes, for what else is written
_PERMIT: Final = (
    "`USER - rtprio 1` in /etc/security/limits.d, LimitRTPRIO=1 in a unit, or CAP_SYS_NICE"
)
_NO_STALLS: Final = (
    "leave a core idle; or, as root, `sysctl -w kernel.sched_rt_runtime_us=-1`, from Linux 6.12 on "
    "also write 0 into each /sys/kernel/debug/sched/fair_server/cpu*/runtime"
)
_BUSY: Final = 2  # processes of one robot that compute all the time: its agent and its plant
_IDLE: Final = frozenset({OPERATOR, RECORDER})


@dataclass(frozen=True, slots=True)
class MachineReadings:
    """What was read of a computer; None is what could not be.

    Attributes:
        realtime: whether this user may schedule in real time.
        reserved: of each second on a core that real-time processes fill, for ordinary ones, s.
        governors: of the processor's cores, each once.
        cores: how many this process may use, after the limits of its container.
        memory: that is free for it, bytes.
        disk: free where runs are recorded, bytes.
        cache: folder of predictors and compiled code.
        cache_writable: whether something can be written there.
        clock_error: of the wall clock, s; 0: nobody keeps it.
        receive_buffer: that a socket may ask for, bytes.
        requirements: what this project asks for: `name>=1.0,<2`.
        installed: versions by name of what is asked for.
    """

    realtime: bool | None
    reserved: float | None
    governors: tuple[str, ...] | None
    cores: float | None
    memory: int | None
    disk: int | None
    cache: str
    cache_writable: bool | None
    clock_error: float | None
    receive_buffer: int | None
    requirements: tuple[str, ...] | None
    installed: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class MachineNeed:
    """What a team asks of a computer.

    Attributes:
        realtime: whether the walk is paced by the clock.
        spread: whether the team runs on several computers.
        busy: processes here that compute all the time.
        count: processes here.
        recorded: bytes of a recording of the walk.
    """

    realtime: bool
    spread: bool
    busy: int
    count: int
    recorded: int


def need_of(config: Config, *, spread: bool) -> MachineNeed:
    """What a configuration asks of a computer: of one among several, one robot's agent and plant.

    Args:
        config: the team's.
        spread: whether its processes run on several computers.
    """
    team = processes(config)
    busy = sum(member.role.name not in _IDLE for member in team)
    return MachineNeed(
        realtime=config.world.mode == "realtime",
        spread=spread,
        busy=_BUSY if spread else busy,
        count=_BUSY if spread else len(team),
        recorded=round(config.team.robots * config.world.duration * _ROBOT_BYTES),
    )


def check_machine(readings: MachineReadings, need: MachineNeed) -> Iterator[Diagnosis]:
    """All checks, one diagnosis each; what could not be read is unknown, never good."""
    r, bad_in_realtime = readings, BAD if need.realtime else NOTE

    def judge(code: str, good: bool, text: str, verdict: str, remedy: str) -> Diagnosis:
        return Diagnosis(code, GOOD, text) if good else Diagnosis(code, verdict, text, remedy)

    if r.realtime is None:
        yield _unknown("realtime", "real-time scheduling")
    else:  # in lock-step a walk needs none
        text = f"real-time scheduling is {'' if r.realtime else 'not '}permitted"
        yield judge("realtime", r.realtime, text, bad_in_realtime, _PERMIT)
    if r.reserved is None:
        yield _unknown("stalls", "how long the kernel stops real-time processes")
    else:  # ordinary processes get their share of a second at once: a bridge stands still
        ms = 1e3 * r.reserved
        text = f"the kernel stops real-time processes for {ms:.0f} ms a second on a full core"
        yield judge("stalls", not (ms and need.realtime), text, NOTE, _NO_STALLS)
    if r.governors is None:
        yield _unknown("governor", "the processor's governor")
    else:  # a processor that sleeps between two ticks is late for the next one
        text = f"the processor's governor is {', '.join(r.governors)}"
        remedy = "sudo cpupower frequency-set -g performance"
        yield judge("governor", {*r.governors} == {"performance"}, text, bad_in_realtime, remedy)
    if r.cores is None:
        yield _unknown("cores", "the number of cores")
    else:
        text = f"{r.cores:g} cores for {need.busy} processes that compute all the time"
        remedy = "none is needed: in lock-step it only takes longer"
        if need.realtime:
            remedy = "spread the team over more computers, or walk in lock-step"
        yield judge("cores", r.cores >= need.busy, text, bad_in_realtime, remedy)
    if r.memory is None:
        yield _unknown("memory", "free memory")
    else:  # every process has libraries and compiled code of its own
        wanted = need.count * _PROCESS_BYTES
        text = f"{_format_bytes(r.memory)} of memory are free for {need.count} processes"
        remedy = f"{_format_bytes(wanted)} are needed: end other programs"
        yield judge("memory", r.memory >= wanted, text, BAD, remedy)
    if r.disk is None:
        yield _unknown("disk", "free space for runs")
    else:
        wanted, free = need.recorded + _LEAST_DISK, _format_bytes(r.disk)
        text = f"{free} are free for runs, a walk takes up to {_format_bytes(wanted)}"
        remedy = "delete old runs, or record elsewhere (--out, -o)"
        yield judge("disk", r.disk >= wanted, text, BAD, remedy)
    if r.cache_writable is None:
        yield _unknown("cache", f"the cache folder {r.cache}")
    else:  # what is not kept is compiled, collected and fitted again for each walk
        can = "can" if r.cache_writable else "cannot"
        text = f"the cache folder {r.cache} {can} be written to and has room"
        remedy = "set XDG_CACHE_HOME to a folder of this user with room"
        yield judge("cache", r.cache_writable, text, BAD, remedy)
    if r.clock_error is None:
        yield _unknown("clock", "how well the wall clock is kept")
    else:  # recordings are read, certificates judged, and plants of single robots paced by it
        text = f"the system clock is kept to {1e3 * r.clock_error:.3g} ms"
        text = text if r.clock_error else "nobody keeps the system clock"
        good = 0.0 < r.clock_error <= CLOCK_LIMIT
        yield judge("clock", good, text, BAD if need.spread else NOTE, CLOCK_REMEDY)
    if r.receive_buffer is None:
        yield _unknown("buffer", "the room for what sockets receive")
    else:  # what comes while a process waits for a core; in lock-step the sender waits
        text = f"sockets may have room for {r.receive_buffer} bytes"
        remedy = f"sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER}, or recordings may have gaps"
        good = r.receive_buffer >= RECEIVE_BUFFER or not need.realtime
        yield judge("buffer", good, text, NOTE, remedy)
    yield check_packages(r.requirements, r.installed)


def check_packages(requirements: tuple[str, ...] | None, installed: Mapping[str, str]) -> Diagnosis:
    """Versions that are installed against those that are asked for.

    Args:
        requirements: such as `name>=1.0,<2`; None: not known.
        installed: versions by name; what is not installed is not in it.
    """
    if requirements is None:
        text = "what this project asks for is not known: it is not installed"
        return Diagnosis("packages", UNKNOWN, text)
    wrong, unread = list[str](), list[str]()
    for line in requirements:
        try:
            wanted = Requirement(line)
            version = installed.get(wanted.name)
            if version is None:
                wrong.append(f"{wanted.name} is not installed")
            elif not wanted.specifier.contains(version, prereleases=True):
                wrong.append(f"{wanted.name} is {version}, not {wanted.specifier}")
        except InvalidRequirement:
            unread.append(line)
    if wrong:
        remedy = "pip install -c requirements.lock -e . in the project's folder"
        return Diagnosis("packages", BAD, "; ".join(wrong), remedy)
    if unread:
        return Diagnosis("packages", UNKNOWN, f"{'; '.join(unread)}: not understood here")
    return Diagnosis("packages", GOOD, f"{len(requirements)} packages are as asked for")


def _unknown(code: str, what: str) -> Diagnosis:
    return Diagnosis(code, UNKNOWN, f"{what} cannot be read here")


def _format_bytes(count: int) -> str:
    return f"{1e-9 * count:.1f} GB" if count >= 1e9 else f"{1e-6 * count:.0f} MB"
