"""Counts of feet become the loads that they came from, and a sensor that tells none is named."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.bridges.foot_calibration import FootScales, fit_scales, to_newtons
from quadriga.bridges.statics import Statics
from quadriga.shared.robot.conventions import FOOT_FRAMES, Array
from quadriga.shared.robot.robots import ROBOTS
from tests.bridges.robots import config_of, standing, tilted

OFFSET, SCALE = 30.0 * np.array([0.0, 1.0, -2.0, 3.0]), np.array([2.3, 1.1, 4.0, 0.7])


def pressed(n: int = 250) -> Array:
    """Loads of feet that press by diagonals, (n, 4), N."""
    wave = 20.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, n))
    loads: Array = 32.0 + wave[:, None] * np.array([1.0, -1.0, -1.0, 1.0])
    return loads


def raw(loads: Array, seed: int = 0) -> Array:
    """What sensors with an offset and a scale of their own make of loads, in 16 bits."""
    noise = np.random.default_rng(seed).standard_normal(loads.shape)
    return np.rint(OFFSET + SCALE * (loads + noise))


def fit(counts: Array, loads: Array) -> FootScales:
    return fit_scales(list(counts), list(loads))


@given(seed=st.integers(0, 10**6), load=st.floats(0.0, 200.0))
def test_counts_become_the_loads_that_they_came_from(seed: int, load: float) -> None:
    loads = pressed()
    scales = fit(raw(loads, seed), loads)
    assert scales.dead == ()
    newtons = to_newtons(OFFSET + SCALE * load, scales)
    np.testing.assert_allclose(newtons, load, rtol=0.05, atol=2.0)


@given(
    counts=st.lists(st.integers(-32768, 32767), min_size=4, max_size=4),
    offset=st.floats(-1e4, 1e4),
    scale=st.floats(0.05, 100.0),
)
def test_no_load_is_negative_and_none_is_infinite(
    counts: list[int], offset: float, scale: float
) -> None:
    newtons = to_newtons(np.array(counts), FootScales(np.full(4, offset), np.full(4, scale)))
    assert np.isfinite(newtons).all()
    assert (newtons >= 0.0).all()


@pytest.mark.parametrize("tells", ["zeros", "one count", "noise", "less under load"])
def test_a_sensor_that_does_not_tell_the_load_is_named_and_gives_nothing(tells: str) -> None:
    loads = pressed()
    counts = raw(loads)
    counts[:, 2] = {
        "zeros": np.zeros(len(loads)),
        "one count": np.full(len(loads), -57.0),
        "noise": np.random.default_rng(1).normal(100.0, 20.0, len(loads)),
        "less under load": 100.0 - loads[:, 2],
    }[tells]
    scales = fit(counts, loads)
    assert scales.dead == (FOOT_FRAMES[2],)
    newtons = to_newtons(counts[60], scales)
    assert newtons[2] == 0.0
    np.testing.assert_allclose(newtons[[0, 1, 3]], loads[60, [0, 1, 3]], atol=6.0)


@given(begin=st.integers(0, 250), length=st.integers(1, 60))
def test_a_sensor_that_fails_for_a_moment_is_calibrated_all_the_same(
    begin: int, length: int
) -> None:
    loads = pressed()
    counts = raw(loads)
    counts[begin : begin + length, 0] = 0.0
    scales = fit(counts, loads)
    assert scales.dead == ()
    assert scales.per_newton[0] == pytest.approx(SCALE[0], rel=0.1)


def test_without_a_change_of_load_or_with_few_reports_nothing_is_calibrated() -> None:
    loads = pressed()
    assert fit(raw(loads)[:20], loads[:20]).dead == FOOT_FRAMES
    still = np.full_like(loads, 30.0)
    assert fit(raw(still), still).dead == FOOT_FRAMES


@pytest.mark.parametrize("kind", list(ROBOTS))
@given(torque=st.floats(-3.0, 3.0), tilt=st.floats(-0.1, 0.1))
def test_loads_carry_the_weight_whatever_the_torques_say(
    kind: str, torque: float, tilt: float
) -> None:
    config = config_of(kind)
    report = standing(config, tau=np.full(12, torque), quat_wxyz=tilted(tilt))
    loads = Statics(config.robot).foot_loads(report, alone=True)
    assert loads.sum() == pytest.approx(config.robot.weight)


@pytest.mark.parametrize("alone", [True, False])
@pytest.mark.parametrize("kind", list(ROBOTS))
def test_the_torques_tell_which_diagonal_bears_more(kind: str, alone: bool) -> None:
    """τ = g − Jᵀ f of a foot under its hip: the calf's torque alone, f times its lever."""
    config = config_of(kind)
    statics, robot = Statics(config.robot), config.robot
    evenly = statics.foot_loads(standing(config), alone=alone)
    press = 10.0  # N more on one diagonal
    tau = np.zeros(12)
    tau[2::3] = press * robot.geometry.link * np.sin(robot.q_stand[1]) * np.array([1, -1, -1, 1])
    more = statics.foot_loads(standing(config, tau=tau), alone=alone) - evenly
    np.testing.assert_allclose(more, press * np.array([1, -1, -1, 1]), atol=0.3)
