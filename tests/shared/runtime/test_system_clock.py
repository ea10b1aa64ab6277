"""The kernel is asked how well it keeps the system clock."""

from __future__ import annotations

import ctypes
import sys

import pytest

from quadriga.shared.runtime import system_clock
from quadriga.shared.runtime.system_clock import LEAST_ERROR_NS, system_clock_error_ns


@pytest.mark.skipif(sys.platform != "linux", reason="adjtimex is Linux's")
def test_the_kernel_s_struct_is_read_where_its_fields_are() -> None:
    """Two fields behind those that are used have known values."""
    found = system_clock._Timex()
    assert ctypes.CDLL(None).adjtimex(ctypes.byref(found)) >= 0
    tolerance, tick = found.rest[2], found.rest[5]
    assert tolerance == 500 << 16  # ppm, of which 16 bits are a fraction
    assert 9_000 <= tick <= 11_000  # µs between two of 100 a second


@pytest.mark.parametrize(
    ("status", "maxerror", "error"),
    [(0x0040, 10, 0), (0x2001, 250, 250_000), (0x2001, 0, LEAST_ERROR_NS)],
)
def test_the_error_is_none_of_a_clock_that_nobody_keeps_and_never_nothing(
    monkeypatch: pytest.MonkeyPatch, status: int, maxerror: int, error: int
) -> None:
    def adjtimex(timex: system_clock._Timex) -> int:
        timex.status, timex.maxerror = status, maxerror
        return 0

    monkeypatch.setattr(system_clock, "_adjtimex", adjtimex)
    monkeypatch.setattr(sys, "platform", "linux")
    assert system_clock_error_ns() == error
