"""Is a computer fit? Decided over readings; what is not read is unknown, never good."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from quadriga.doctor import readings
from quadriga.doctor.machine import (
    MachineNeed,
    MachineReadings,
    check_machine,
    check_packages,
    need_of,
)
from quadriga.doctor.readings import read_machine
from quadriga.shared.bus.diagnostics import BAD, GOOD, NOTE, UNKNOWN
from quadriga.shared.config.load import load

FIT = MachineReadings(
    realtime=True,
    reserved=0.0,
    governors=("performance",),
    cores=8.0,
    memory=16 * 10**9,
    disk=100 * 10**9,
    cache="/home/u/.cache/quadriga",
    cache_writable=True,
    clock_error=0.001,
    receive_buffer=8 << 20,
    requirements=("numpy>=2.0",),
    installed={"numpy": "2.4.0"},
)
WALK = MachineNeed(realtime=True, spread=True, busy=4, count=6, recorded=10**8)
LOCKSTEP = replace(WALK, realtime=False, spread=False)


def verdicts(need: MachineNeed = WALK, **changes: Any) -> dict[str, str]:
    """What is not good, by code."""
    found = [*check_machine(replace(FIT, **changes), need)]
    assert all(item.remedy for item in found if item.verdict in (BAD, NOTE))
    return {item.code: item.verdict for item in found if item.verdict != GOOD}


def test_a_fit_computer_is_good_at_everything() -> None:
    assert verdicts() == {}
    assert len([*check_machine(FIT, WALK)]) == 10


@pytest.mark.parametrize(
    ("changes", "code", "in_lockstep"),
    [
        ({"realtime": False}, "realtime", NOTE),
        ({"governors": ("performance", "powersave")}, "governor", NOTE),
        ({"cores": 3.9}, "cores", NOTE),
        ({"memory": 10**9}, "memory", BAD),
        ({"disk": 10**8}, "disk", BAD),
        ({"cache_writable": False}, "cache", BAD),
        ({"clock_error": 0.0}, "clock", NOTE),
        ({"clock_error": 0.2}, "clock", NOTE),
        ({"installed": {}}, "packages", BAD),
    ],
)
def test_each_lack_is_found_and_judged_by_what_the_walk_needs(
    changes: dict[str, Any], code: str, in_lockstep: str
) -> None:
    assert verdicts(**changes) == {code: BAD}
    assert verdicts(LOCKSTEP, **changes) == {code: in_lockstep}


def test_what_the_kernel_keeps_from_real_time_processes_is_noted() -> None:
    assert verdicts(reserved=0.05) == {"stalls": NOTE}
    assert verdicts(LOCKSTEP, reserved=0.05) == {}


@pytest.mark.parametrize(
    ("release", "runtime", "server", "reserved"),
    [
        ("5.15.0-91-generic", "950000", None, 0.05),
        ("5.15.0-91-generic", "-1", None, 0.0),
        ("6.18.44", "-1", None, 0.05),
        ("6.18.44", "950000", "20000000", 0.02),
        ("6.12", "-1", "0", 0.0),
    ],
)
def test_the_kernels_share_is_read_of_what_decides_it(
    release: str,
    runtime: str,
    server: str | None,
    reserved: float,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From Linux 6.12 on the fair server does, whatever the throttling of before says."""
    (tmp_path / "runtime").write_text(runtime)
    if server is not None:
        (tmp_path / "cpu0").mkdir()
        (tmp_path / "cpu0/runtime").write_text(server)
    monkeypatch.setattr(readings, "_RT_RUNTIME", tmp_path / "runtime")
    monkeypatch.setattr(readings, "_FAIR", tmp_path)
    monkeypatch.setattr("platform.release", lambda: release)
    assert readings._reserved() == pytest.approx(reserved)


def test_the_kernel_s_struct_is_read_where_its_fields_are() -> None:
    """Two fields behind those that are used have known values."""
    found = readings.Timex()
    assert readings._adjtimex(found) >= 0
    tolerance, tick = found.rest[2], found.rest[5]
    assert tolerance == 500 << 16  # ppm, of which 16 bits are a fraction
    assert 9_000 <= tick <= 11_000  # µs between two of 100 a second


@pytest.mark.parametrize(
    ("status", "maxerror", "error"),
    [(0x0040, 10, 0.0), (0x2001, 250, 1e-6 * 250), (0x2001, 0, 1e-4)],
)
def test_the_error_is_none_of_a_clock_that_nobody_keeps_and_never_nothing(
    monkeypatch: pytest.MonkeyPatch, status: int, maxerror: int, error: float
) -> None:
    def adjtimex(timex: readings.Timex) -> int:
        timex.status, timex.maxerror = status, maxerror
        return 0

    monkeypatch.setattr(readings, "_adjtimex", adjtimex)
    assert readings._clock_error() == error


def test_little_room_for_what_is_received_matters_in_real_time_alone() -> None:
    assert verdicts(receive_buffer=212_992) == {"buffer": NOTE}
    assert verdicts(LOCKSTEP, receive_buffer=212_992) == {}


def test_what_cannot_be_read_is_unknown() -> None:
    nothing: dict[str, Any] = dict.fromkeys(f.name for f in fields(FIT))
    nothing |= {"cache": "", "installed": {}}
    found = [*check_machine(replace(FIT, **nothing), WALK)]
    assert {item.verdict for item in found} == {UNKNOWN}
    assert len({item.text for item in found}) == 10


def test_a_team_at_a_loopback_address_runs_here_as_a_whole() -> None:
    config = load(None, {"team.robots": 5, "world.duration": 10.0, "world.mode": "realtime"})
    whole, part = need_of(config, spread=False), need_of(config, spread=True)
    assert (whole.busy, whole.count, whole.realtime) == (6, 8, True)
    assert (part.busy, part.count) == (2, 2)
    assert whole.recorded == 5 * 10 * 400_000


NAMES = ("numpy", "mujoco", "pin", "Some-Name")


@pytest.mark.parametrize(
    ("requirement", "version", "verdict"),
    [
        ("numpy>=2.0", "2.0", GOOD),
        ("numpy>=2.0", "1.26.4", BAD),
        ("mujoco>=4.0,<5", "4.10.1", GOOD),
        ("mujoco<5,>=4.0", "5.0", BAD),
        ("mujoco (>=4.0,<5)", "3.9.9", BAD),
        ("pin==4.1", "4.1.0", GOOD),
        ("pin==4.1", "4.1.1", BAD),
        ("pin>=4.1", "4.2.0rc1", GOOD),
        ("pin~=4.1", "5.0", BAD),
        ("pin>4.1;", "4.2.0", UNKNOWN),
        ("pin>=4.1", "unknown", BAD),
        ("pin", "1", GOOD),
        ("Some-Name[extra]>=1", "2", GOOD),
    ],
)
def test_a_version_is_held_against_its_bounds(requirement: str, version: str, verdict: str) -> None:
    found = check_packages((requirement,), dict.fromkeys(NAMES, version))
    assert found.verdict == verdict


def test_a_package_that_is_wrong_is_named() -> None:
    found = check_packages(("numpy>=2.0,<3", "osqp>=1.1"), {"numpy": "1.26"})
    assert found.text == "numpy is 1.26, not <3,>=2.0; osqp is not installed"


def test_this_computer_is_read_and_has_the_packages_that_it_is_tested_with() -> None:
    found = read_machine()
    assert found.cores is not None
    assert found.cores > 0
    assert found.memory is not None
    assert found.disk is not None
    assert found.cache.endswith("/quadriga")
    packages = check_packages(found.requirements, found.installed)
    assert packages.verdict == GOOD, packages.text
