"""Each check passes for a robot that lies as it should, and names what is not right."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadriga.bridges.checks import Finding, check_reports, refuse_failed
from quadriga.shared.errors import CheckError
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.unitree.packets import PROTECTED, Battery, RobotReport
from tests.bridges.robots import config_of, standing, tilted


def lying(kind: str = "a1", **fields: Any) -> list[RobotReport]:
    """A second of reports of a robot that lies still."""
    config = config_of(kind)
    report = replace(standing(config, q=config.robot.q_lying), **fields)
    return [replace(report, tick=tick) for tick in range(1000)]


def check(reports: list[RobotReport], kind: str = "a1") -> dict[str, Finding]:
    config = config_of(kind)
    findings = check_reports(reports, 1.0, 1, config.bridge, config.robot)
    return {finding.name: finding for finding in findings}


@pytest.mark.parametrize("kind", list(ROBOTS))
def test_a_robot_that_lies_still_passes(kind: str) -> None:
    findings = check(lying(kind), kind)
    refuse_failed("r1", list(findings.values()))
    assert set(SICK) <= set(findings)


def test_a_real_go2_that_lies_warm_passes() -> None:
    """As one reported itself: calves beyond the URDF's stop, 72 and 78 °C, 9.61 m/s²."""
    q, temperature = config_of("go2").robot.q_lying.copy(), np.full(12, 45.0)
    q[2::3], temperature[[2, 5]] = [-2.811, -2.803, -2.808, -2.805], [72.0, 78.0]
    findings = check(lying("go2", q=q, temperature=temperature, accel=[-0.23, 0.13, 9.60]), "go2")
    refuse_failed("r1", list(findings.values()))
    refused = check(lying("go2", temperature=np.full(12, 81.0)), "go2")
    assert [finding.name for finding in refused.values() if not finding.ok] == ["temperature"]


CALF_AND_THIGH_SWAPPED = config_of().robot.q_lying.reshape(4, 3)[:, [0, 2, 1]].ravel()
ONE_LEG_STRAIGHT = np.concatenate([[0.0, 0.0, -0.95], config_of().robot.q_lying[3:]])
SICK: dict[str, dict[str, Any]] = {
    "battery": {"battery": Battery(19, 0.0)},
    "motors in protection mode": {"mode": np.array([PROTECTED] + [0] * 11, np.uint8)},
    "temperature": {"temperature": np.full(12, 71.0)},
    "joint angles": {"q": CALF_AND_THIGH_SWAPPED},
    "legs": {"q": ONE_LEG_STRAIGHT},
    "gyro": {"gyro": np.array([0.0, 0.4, 0.0])},
    "joint rates": {"dq": np.full(12, 0.6)},
    "posture": {"quat_wxyz": tilted(3.0), "accel": np.array([0.0, 0.0, -9.81])},
    "accelerometer": {"accel": np.array([0.0, 0.0, 7.0])},
    "attitude": {"quat_wxyz": tilted(0.4)},
    "numbers": {"q": np.full(12, np.nan)},
}


@pytest.mark.parametrize("name", list(SICK))
def test_what_is_not_right_is_named(name: str) -> None:
    findings = check(lying(**SICK[name]))
    assert not findings[name].ok
    with pytest.raises(CheckError, match=r"robot r2: .*: got .*, expected "):
        refuse_failed("r2", list(findings.values()))


def test_too_few_reports_or_always_the_same_are_named() -> None:
    assert not check([])["reports"].ok
    assert not check(lying()[:700])["reports"].ok
    hanging = [lying()[0]] * 1000
    assert not check(hanging)["its counter"].ok


@pytest.mark.parametrize("kind", list(ROBOTS))
@pytest.mark.parametrize("joint", [2, 11])
@pytest.mark.parametrize("off", [0.69, -0.69])  # rad: a turn of the motor behind its gear
def test_an_uncalibrated_calf_is_refused(kind: str, joint: int, off: float) -> None:
    wrong = config_of(kind).robot.q_lying + off * (np.arange(12) == joint)
    with pytest.raises(CheckError) as caught:
        refuse_failed("r1", list(check(lying(kind, q=wrong), kind).values()))
    assert caught.value.name in ("robot r1: joint angles", "robot r1: legs")
    assert "zero" in caught.value.cause


def test_what_hangs_may_have_its_feet_anywhere_and_all_packets_that_came_count() -> None:
    config = config_of()
    limits = 1.0, 1, config.bridge, config.robot
    refuse_failed("r1", check_reports(lying(q=ONE_LEG_STRAIGHT), *limits, hung=True))
    few = lying()[::4]
    assert [f.name for f in check_reports(few, *limits) if not f.ok] == ["reports"]
    refuse_failed("r1", check_reports(few, *limits, received=1000))
