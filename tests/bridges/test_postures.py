"""Motions begin and end at rest, pass their postures, and stay within the joints' limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.bridges.limits import joint_limits
from quadriga.shared.robots.motions import posture_at, way_down, way_up
from quadriga.shared.robots.registry import ROBOTS
from tests.bridges.robots import config_of


@pytest.mark.parametrize("kind", list(ROBOTS))
@given(share=st.floats(0.0, 1.0), at=st.floats(0.0, 1.0))
def test_from_any_posture_to_the_stand_and_down(kind: str, share: float, at: float) -> None:
    config = config_of(kind)
    lower, upper = np.array(config.robot.lower), np.array(config.robot.upper)
    q = lower + share * (upper - lower)
    limits = joint_limits(config.bridge, config.robot)
    assert (config.robot.q_lying >= limits.lower).all()
    assert (config.robot.q_lying <= limits.upper).all()
    seconds = config.bridge.stand_s
    up, down = way_up(q, config.robot, seconds), way_down(q, config.robot, seconds)
    for motion, end in ((up, config.robot.q_stand), (down, config.robot.q_lying)):
        first, still = posture_at(motion, 0.0)
        np.testing.assert_allclose(first, q)
        np.testing.assert_allclose(still, 0.0)
        last, still = posture_at(motion, motion.seconds + 1.0)
        np.testing.assert_allclose(last, end)
        np.testing.assert_allclose(still, 0.0, atol=1e-9)
        now, rate = posture_at(motion, at * motion.seconds)
        assert (now >= lower - 1e-9).all()
        assert (now <= upper + 1e-9).all()
        assert (np.abs(rate) < limits.speed).all()


def test_the_rate_is_that_of_the_angle() -> None:
    config = config_of()
    motion = way_up(config.robot.q_lying, config.robot, config.bridge.stand_s)
    for seconds in np.linspace(0.01, motion.seconds - 0.01, 40):
        before, after = (posture_at(motion, seconds + d)[0] for d in (-1e-5, 1e-5))
        np.testing.assert_allclose(
            (after - before) / 2e-5, posture_at(motion, seconds)[1], atol=1e-3
        )
