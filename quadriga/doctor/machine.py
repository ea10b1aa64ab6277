"""Whether a computer is fit for its part of a team: pure checks over what was read of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from quadriga.doctor.packages import check_packages
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

REALTIME: Final = "realtime"
STALLS: Final = "stalls"
GOVERNOR: Final = "governor"
CORES: Final = "cores"
MEMORY: Final = "memory"
DISK: Final = "disk"
CACHE: Final = "cache"
CLOCK: Final = "clock"
BUFFER: Final = "buffer"

_PROCESS_BYTES: Final = 400_000_000  # of memory that a process takes, at most
_ROBOT_BYTES: Final = 400_000  # recorded of a robot in a second of a walk, at most
_LEAST_DISK: Final = 200_000_000  # bytes, for what else is written
_NO_STALLS: Final = (
    "leave a core idle; or, as root, `sysctl -w kernel.sched_rt_runtime_us=-1`, from Linux 6.12 on "
    "also write 0 into each /sys/kernel/debug/sched/fair_server/cpu*/runtime"
)
_FAST: Final = frozenset({"performance"})
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
        shadowing: files that are imported in the place of what is installed.
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
    shadowing: Sequence[str] = ()


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
        realtime=config.world.mode == REALTIME,
        spread=spread,
        busy=_BUSY if spread else busy,
        count=_BUSY if spread else len(team),
        recorded=round(config.team.robots * config.world.duration * _ROBOT_BYTES),
    )


def check_machine(readings: MachineReadings, need: MachineNeed) -> tuple[Diagnosis, ...]:
    """All checks, one diagnosis each; what could not be read is unknown, never good."""
    return (
        check_realtime(readings.realtime, need),
        check_stalls(readings.reserved, need),
        check_governor(readings.governors, need),
        check_cores(readings.cores, need),
        check_memory(readings.memory, need),
        check_disk(readings.disk, need),
        check_cache(readings.cache_writable, readings.cache),
        check_clock(readings.clock_error, need),
        check_buffer(readings.receive_buffer, need),
        check_packages(readings.requirements, readings.installed, readings.shadowing),
    )


def check_realtime(permitted: bool | None, need: MachineNeed) -> Diagnosis:
    """Real-time scheduling: in lock-step a walk needs none."""
    if permitted is None:
        return _unknown(REALTIME, "real-time scheduling")
    if permitted:
        return Diagnosis(REALTIME, GOOD, "real-time scheduling is permitted")
    remedy = "`USER - rtprio 1` in /etc/security/limits.d, LimitRTPRIO=1 in a unit, or CAP_SYS_NICE"
    text = "real-time scheduling is not permitted"
    return Diagnosis(REALTIME, BAD if need.realtime else NOTE, text, remedy)


def check_stalls(reserved: float | None, need: MachineNeed) -> Diagnosis:
    """Ordinary processes get their share of a second at once: a bridge stands still."""
    if reserved is None:
        return _unknown(STALLS, "how long the kernel stops real-time processes")
    if not reserved:
        return Diagnosis(STALLS, GOOD, "the kernel stops no real-time processes")
    text = (
        f"the kernel stops real-time processes for {1e3 * reserved:.0f} ms a second on a full core"
    )
    return Diagnosis(STALLS, NOTE if need.realtime else GOOD, text, _NO_STALLS * need.realtime)


def check_governor(governors: tuple[str, ...] | None, need: MachineNeed) -> Diagnosis:
    """A processor that sleeps between two ticks is late for the next one."""
    if governors is None:
        return _unknown(GOVERNOR, "the processor's governor")
    text = f"the processor's governor is {', '.join(governors)}"
    if _FAST.issuperset(governors):
        return Diagnosis(GOVERNOR, GOOD, text)
    remedy = "sudo cpupower frequency-set -g performance"
    return Diagnosis(GOVERNOR, BAD if need.realtime else NOTE, text, remedy)


def check_cores(cores: float | None, need: MachineNeed) -> Diagnosis:
    """In real time each process that computes all the time needs a core of its own."""
    if cores is None:
        return _unknown(CORES, "the number of cores")
    text = f"{cores:g} cores for {need.busy} processes that compute all the time"
    if cores >= need.busy:
        return Diagnosis(CORES, GOOD, text)
    if not need.realtime:
        return Diagnosis(CORES, NOTE, text, "none is needed: in lock-step it only takes longer")
    remedy = "spread the team over more computers, or walk in lock-step"
    return Diagnosis(CORES, BAD, text, remedy)


def check_memory(free: int | None, need: MachineNeed) -> Diagnosis:
    """Every process has libraries and compiled code of its own."""
    if free is None:
        return _unknown(MEMORY, "free memory")
    text = f"{_format_bytes(free)} of memory are free for {need.count} processes"
    if free >= need.count * _PROCESS_BYTES:
        return Diagnosis(MEMORY, GOOD, text)
    remedy = f"{_format_bytes(need.count * _PROCESS_BYTES)} are needed: end other programs"
    return Diagnosis(MEMORY, BAD, text, remedy)


def check_disk(free: int | None, need: MachineNeed) -> Diagnosis:
    """A full disk ends a recording."""
    if free is None:
        return _unknown(DISK, "free space for runs")
    wanted = need.recorded + _LEAST_DISK
    text = f"{_format_bytes(free)} are free for runs, a walk takes up to {_format_bytes(wanted)}"
    if free >= wanted:
        return Diagnosis(DISK, GOOD, text)
    return Diagnosis(DISK, BAD, text, "delete old runs, or record elsewhere (--out, -o)")


def check_cache(writable: bool | None, folder: str) -> Diagnosis:
    """What is not kept is compiled, collected and fitted again for each walk."""
    if writable is None:
        return _unknown(CACHE, f"the cache folder {folder}")
    if writable:
        return Diagnosis(CACHE, GOOD, f"the cache folder {folder} can be written to")
    text = f"the cache folder {folder} cannot be written to, or its disk is full"
    return Diagnosis(CACHE, BAD, text, "set XDG_CACHE_HOME to a folder of this user with room")


def check_buffer(permitted: int | None, need: MachineNeed) -> Diagnosis:
    """Room for what comes while a process waits for a core; in lock-step the sender waits."""
    if permitted is None:
        return _unknown(BUFFER, "the room for what sockets receive")
    text = f"sockets may have room for {permitted} bytes"
    if permitted >= RECEIVE_BUFFER:
        return Diagnosis(BUFFER, GOOD, text)
    remedy = f"sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER}, or recordings may have gaps"
    return Diagnosis(BUFFER, NOTE if need.realtime else GOOD, text, remedy if need.realtime else "")


def check_clock(error: float | None, need: MachineNeed) -> Diagnosis:
    """Recordings are read, certificates judged, and plants of single robots paced by it."""
    if error is None:
        return _unknown(CLOCK, "how well the wall clock is kept")
    if not error:
        verdict = BAD if need.spread else NOTE
        return Diagnosis(CLOCK, verdict, "nobody keeps the system clock", CLOCK_REMEDY)
    text = f"the system clock is kept to {1e3 * error:.3g} ms"
    if error <= CLOCK_LIMIT:
        return Diagnosis(CLOCK, GOOD, text)
    return Diagnosis(CLOCK, BAD if need.spread else NOTE, text, CLOCK_REMEDY)


def _unknown(code: str, what: str) -> Diagnosis:
    return Diagnosis(code, UNKNOWN, f"{what} cannot be read here")


def _format_bytes(count: int) -> str:
    return f"{1e-9 * count:.1f} GB" if count >= 1e9 else f"{1e-6 * count:.0f} MB"
