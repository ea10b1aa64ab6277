"""Any command and any report of a robot, for tests of both directions."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from quadriga.shared.unitree.packets import OFF, SERVO, Battery, MotorTargets, RobotReport


@st.composite
def any_targets(draw: st.DrawFn) -> MotorTargets:
    """Finite numbers within what a packet of 16 bits can hold."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    mode = random.choice([OFF, SERVO], 12).astype(np.uint8)
    angles, rates = random.uniform(-4.0, 4.0, 12), random.uniform(-30.0, 30.0, 12)
    torques = random.uniform(-127.0, 127.0, 12)
    return MotorTargets(
        mode, angles, rates, torques, random.uniform(0, 1000, 12), random.uniform(0, 2000, 12)
    )


@st.composite
def any_report(draw: st.DrawFn) -> RobotReport:
    """Numbers that a robot may send."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    return RobotReport(
        tick=int(random.integers(0, 2**32)),
        quat_wxyz=random.normal(size=4),
        gyro=random.normal(size=3),
        accel=9.81 * random.normal(size=3),
        q=random.uniform(-4.0, 4.0, 12),
        dq=random.uniform(-30.0, 30.0, 12),
        tau=random.uniform(-60.0, 60.0, 12),
        foot=random.integers(-300, 3000, 4).astype(float),
        mode=random.integers(0, 16, 12).astype(np.uint8),
        temperature=random.integers(-40, 100, 12).astype(float),
        lost=random.integers(0, 1000, 12),
        imu_temperature=int(random.integers(-40, 100)),
        remote=random.bytes(40),
        battery=Battery(int(random.integers(0, 101)), float(random.integers(-9000, 9000)) / 1000),
    )
