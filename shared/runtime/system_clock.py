"""How well the system keeps its wall clock: what a daemon of PTP or NTP has told the kernel."""

from __future__ import annotations

import ctypes
import sys
from typing import Final

# Some daemons (phc2sys of linuxptp, systemd-timesyncd) tell the kernel of no error at all.
LEAST_ERROR_NS: Final = 100_000
_UNSYNCHRONISED: Final = 0x0040  # STA_UNSYNC of <sys/timex.h>


class _Timex(ctypes.Structure):
    """`struct timex` of <sys/timex.h>, on 64 bits."""

    _fields_ = (
        ("modes", ctypes.c_uint),  # 0: nothing is changed
        ("offset_and_freq", ctypes.c_long * 2),
        ("maxerror", ctypes.c_long),  # µs
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_long * 32),  # more than the kernel writes
    )


def system_clock_error_ns() -> int:
    """How far the wall clock may be off true time, ns; 0 if nobody says that it is synchronised.

    It is never said to be better than `LEAST_ERROR_NS`. The kernel lets the error grow by 500 ppm
    from one correction to the next.
    """
    found = _Timex()
    if sys.platform != "linux" or _adjtimex(found) < 0 or found.status & _UNSYNCHRONISED:
        return 0
    return max(1000 * int(found.maxerror), LEAST_ERROR_NS)


def _adjtimex(found: _Timex) -> int:
    return int(ctypes.CDLL(None).adjtimex(ctypes.byref(found)))
