"""Whatever is asked for, the torque that the motors give is within the limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.bridges.limits import joint_limits, limit_targets, shares_of_speed
from quadriga.shared.robots.conventions import Array
from quadriga.shared.unitree.codecs import A1
from quadriga.shared.unitree.packets import MotorTargets
from tests.bridges.robots import config_of, holding

CONFIG = config_of()
LIMITS = joint_limits(CONFIG.bridge, CONFIG.robot)
STILL = CONFIG.robot.q_stand.copy(), np.zeros(12)
EXTREME = st.one_of(st.floats(), st.floats(-1e3, 1e3))


def given_torque(targets: MotorTargets, q: Array, dq: Array) -> Array:
    """What a motor does with a command."""
    torque: Array = targets.tau + targets.kp * (targets.q - q) + targets.kd * (targets.dq - dq)
    return torque


def test_a_command_within_the_limits_passes_unchanged() -> None:
    targets = holding(CONFIG, tau=np.linspace(-5.0, 5.0, 12))
    limited = limit_targets(targets, *STILL, np.zeros(12), 1, LIMITS)
    assert limited.cut == ()
    for name in ("q", "dq", "tau", "kp", "kd"):
        np.testing.assert_allclose(getattr(limited.targets, name), getattr(targets, name))


@given(
    asked=st.lists(EXTREME, min_size=60, max_size=60),
    q=st.lists(st.floats(-4.0, 4.0), min_size=12, max_size=12),
    dq=st.lists(st.floats(-60.0, 60.0), min_size=12, max_size=12),
    before=st.floats(-30.0, 30.0),
    ms=st.integers(1, 50),
)
def test_no_command_gives_more_than_the_limits(
    asked: list[float], q: list[float], dq: list[float], before: float, ms: int
) -> None:
    rows = np.array(asked).reshape(5, 12)
    measured = np.array(q), np.array(dq)
    last = np.full(12, before)
    with np.errstate(over="ignore", invalid="ignore"):
        limited = limit_targets(
            MotorTargets(holding(CONFIG).mode, *rows), *measured, last, ms, LIMITS
        )
    torque = given_torque(limited.targets, *measured)
    trusted = np.isfinite(shares_of_speed(*measured, LIMITS.speed, LIMITS))
    np.testing.assert_allclose(torque[trusted], limited.torque[trusted], rtol=1e-9, atol=1e-6)
    assert (np.abs(limited.torque) <= LIMITS.torque + 1e-6).all()
    power = np.maximum(limited.torque * measured[1], 0.0)[trusted].sum()
    assert power <= LIMITS.power * (1 + 1e-9) + 1e-6
    assert (np.abs(limited.targets.tau) <= LIMITS.torque + 1e-6).all()
    on = limited.targets.kp > 0.0
    assert (limited.targets.q >= LIMITS.lower)[on].all()
    assert (limited.targets.q <= LIMITS.upper)[on].all()
    A1.encode_command(limited.targets)  # whatever comes out can be sent


@given(
    q=st.lists(EXTREME, min_size=12, max_size=12),
    dq=st.lists(EXTREME, min_size=12, max_size=12),
    gain=st.floats(0.0, 500.0),
)
def test_no_measurement_makes_the_feed_forward_torque_exceed_the_limits(
    q: list[float], dq: list[float], gain: float
) -> None:
    """The numbers of a sensor that fails must not come out as torque."""
    measured = np.array(q), np.array(dq)
    targets = holding(CONFIG, kp=np.full(12, gain), kd=np.full(12, gain / 20.0))
    with np.errstate(over="ignore", invalid="ignore"):
        limited = limit_targets(targets, *measured, np.zeros(12), 1, LIMITS)
    wrong = np.isinf(shares_of_speed(*measured, LIMITS.speed, LIMITS))
    np.testing.assert_array_equal(limited.targets.kp[wrong], 0.0)
    assert (np.abs(limited.targets.tau) <= LIMITS.torque + 1e-9).all()
    assert (np.abs(limited.torque) <= LIMITS.torque + 1e-9).all()
    A1.encode_command(limited.targets)


@given(tau=st.floats(-1e3, 1e3), before=st.floats(-20.0, 20.0), ms=st.integers(1, 4))
def test_the_torque_changes_no_faster_than_allowed(tau: float, before: float, ms: int) -> None:
    targets = holding(CONFIG, tau=np.full(12, tau))
    limited = limit_targets(targets, *STILL, np.full(12, before), ms, LIMITS)
    assert (np.abs(limited.torque - before) <= LIMITS.torque_rate * ms + 1e-9).all()


@pytest.mark.parametrize(("end", "push"), [("upper", 5.0), ("lower", -5.0)])
def test_a_joint_at_its_end_is_pushed_no_further(end: str, push: float) -> None:
    q = getattr(LIMITS, end) + (0.01 if end == "upper" else -0.01)
    free = holding(CONFIG, q=q, tau=np.full(12, push), kp=np.zeros(12))
    limited = limit_targets(free, q, np.zeros(12), np.zeros(12), 1, LIMITS)
    np.testing.assert_array_equal(limited.torque, 0.0)
    assert "end-stop" in limited.cut
    away = replace(free, tau=np.full(12, -push))
    back = limit_targets(away, q, np.zeros(12), np.zeros(12), 1, LIMITS)
    np.testing.assert_allclose(back.torque, -push)


def test_every_limit_is_named() -> None:
    hard = {
        "finite": (holding(CONFIG, tau=np.full(12, np.nan)), STILL),
        "measured": (holding(CONFIG), (STILL[0], np.full(12, 50.0))),
        "gain": (holding(CONFIG, kp=np.full(12, 1e4)), STILL),
        "position": (holding(CONFIG, q=np.full(12, 9.0)), STILL),
        "speed": (holding(CONFIG, dq=np.full(12, 99.0)), STILL),
        "torque": (holding(CONFIG, tau=np.full(12, 99.0)), STILL),
        "rate": (holding(CONFIG, tau=np.full(12, 20.0)), STILL),
        "power": (
            holding(CONFIG, tau=np.full(12, 28.0), kd=np.zeros(12)),
            (STILL[0], np.full(12, 15.0)),
        ),
    }
    for name, (targets, measured) in hard.items():
        assert name in limit_targets(targets, *measured, np.zeros(12), 1, LIMITS).cut
