"""SHELL: what can be read of this computer. What cannot be read is None."""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import platform
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

from packaging.requirements import InvalidRequirement, Requirement

from quadriga.doctor.machine import MachineReadings
from quadriga.shared.runtime.installed import PROJECT
from quadriga.shared.runtime.places import cache_dir
from quadriga.team.run_folder import RUNS

T = TypeVar("T")

_CORES: Final = Path("/sys/devices/system/cpu")
_RECEIVE_BUFFER: Final = Path("/proc/sys/net/core/rmem_max")
_RT_RUNTIME: Final = Path("/proc/sys/kernel/sched_rt_runtime_us")
_FAIR: Final = Path("/sys/kernel/debug/sched/fair_server")
_FAIR_DEFAULT: Final = 0.05  # s of each second
_CGROUP: Final = Path("/sys/fs/cgroup")
_UNLIMITED: Final = "max"
# s; some daemons (phc2sys of linuxptp, systemd-timesyncd) tell the kernel of no error at all.
_LEAST_ERROR: Final = 1e-4
_UNSYNCHRONISED: Final = 0x0040  # STA_UNSYNC of <sys/timex.h>
_CACHE_BYTES: Final = 200_000_000  # of machine code, and of data and predictors of some teams


def read_machine() -> MachineReadings:
    """Look at this computer, as this user and in this folder; nothing is changed."""
    requirements = _read(_requirements)
    names = list[str]()
    for line in requirements or ():
        with suppress(InvalidRequirement):  # `check_packages` names it
            names.append(Requirement(line).name)
    versions = {name: _read(partial(importlib.metadata.version, name)) for name in names}
    return MachineReadings(
        realtime=_read(_may_take_realtime),
        reserved=_read(_reserved),
        governors=_read(_governors),
        cores=_read(_cores),
        memory=_read(_free_memory),
        disk=_read(lambda: shutil.disk_usage(_existing(RUNS)).free),
        cache=str(cache_dir()),
        cache_writable=_read(lambda: _has_room(_existing(cache_dir()))),
        clock_error=_read(_clock_error),
        receive_buffer=_read(lambda: int(_RECEIVE_BUFFER.read_text(encoding="ascii"))),
        requirements=requirements,
        installed={name: version for name, version in versions.items() if version},
    )


class Timex(ctypes.Structure):
    """`struct timex` of <sys/timex.h>, on 64 bits."""

    _fields_ = (
        ("modes", ctypes.c_uint),  # 0: nothing is changed
        ("offset_and_freq", ctypes.c_long * 2),
        ("maxerror", ctypes.c_long),  # µs
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_long * 32),  # more than the kernel writes
    )


def _clock_error() -> float:
    """How far the wall clock may be off, s, as a daemon of PTP or NTP has told the kernel.

    0 if none keeps it. The kernel lets the error grow by 500 ppm between two corrections.
    """
    found = Timex()
    if _adjtimex(found) < 0 or found.status & _UNSYNCHRONISED:
        return 0.0
    return max(1e-6 * int(found.maxerror), _LEAST_ERROR)


def _adjtimex(found: Timex) -> int:
    return int(ctypes.CDLL(None).adjtimex(ctypes.byref(found)))


def _read(call: Callable[[], T]) -> T | None:
    try:
        return call()
    except (OSError, ValueError, importlib.metadata.PackageNotFoundError):
        return None


def _may_take_realtime() -> bool:
    """Whether the system lets this user do it: by doing it for a moment."""
    before, priority = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
    except PermissionError:
        return False
    os.sched_setscheduler(0, before, priority)
    return True


def _reserved() -> float:
    """What ordinary processes get of a second on a full core, s.

    From Linux 6.12 on the fair server gives it to them, whose settings root alone can read where
    debugfs is mounted; before that it was the throttling of real-time processes.
    """
    kept = [1e-9 * int(file.read_text(encoding="ascii")) for file in _FAIR.glob("cpu*/runtime")]
    release = re.match(r"(\d+)\.(\d+)", platform.release())
    if release and (int(release[1]), int(release[2])) >= (6, 12):
        return max(kept, default=_FAIR_DEFAULT)
    runtime = int(_RT_RUNTIME.read_text(encoding="ascii"))
    return 0.0 if runtime < 0 else 1.0 - 1e-6 * runtime


def _governors() -> tuple[str, ...] | None:
    files = _CORES.glob("cpu[0-9]*/cpufreq/scaling_governor")
    return tuple(sorted({file.read_text(encoding="ascii").strip() for file in files})) or None


def _cores() -> float:
    permitted = float(len(os.sched_getaffinity(0)))
    quota, _, period = (_read_limit("cpu.max") or _UNLIMITED).partition(" ")
    return permitted if quota == _UNLIMITED else min(permitted, int(quota) / int(period))


def _free_memory() -> int:
    lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    kib = next(line.split()[1] for line in lines if line.startswith("MemAvailable:"))
    limit = _read_limit("memory.max") or _UNLIMITED
    if limit == _UNLIMITED:
        return 1024 * int(kib)
    return min(1024 * int(kib), int(limit) - int(_read_limit("memory.current")))


def _read_limit(name: str) -> str:
    """What limits this process's container; "" where it has none of its own."""
    file = _CGROUP / name
    return file.read_text(encoding="ascii").strip() if file.is_file() else ""


def _has_room(folder: Path) -> bool:
    """Whether what is kept between walks can be written there."""
    return os.access(folder, os.W_OK | os.X_OK) and shutil.disk_usage(folder).free > _CACHE_BYTES


def _existing(folder: Path) -> Path:
    """The folder, or the one above it in which it would be made."""
    return next(path for path in (folder, *folder.resolve().parents) if path.exists())


def _requirements() -> tuple[str, ...]:
    """What this project asks for, without its extras."""
    lines = importlib.metadata.requires(PROJECT) or []
    return tuple(line for line in lines if ";" not in line)
