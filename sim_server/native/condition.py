"""The condition of a simulated robot beside its mechanics: what its board adds to each report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robot.conventions import N_JOINTS, Array
from quadriga.shared.unitree.packets import OFF, PROTECTED, Battery, MotorTargets, RobotReport
from quadriga.shared.unitree.remote import RemoteReading, write_remote
from quadriga.shared.wire.messages import Command, State

FULL: Final = 80.0  # %, charge of a robot that is switched on
_DRAIN: Final = 1.0 / 60_000.0  # % per ms: a full battery lasts 100 minutes
_EMPTY_V, _FULL_V = 21.0, 24.75  # V of an empty battery and of a full one
_CURRENT: Final = -5.0  # A
_COLD, _WARMER = 30.0, 40.0  # °C: of a motor at rest, and of one that gives all that lasts
_IMU_TEMPERATURE: Final = 40  # °C
_COUNTER: Final = 1 << 32  # values of a robot's counter
_LOST: Final = 0.05  # packets that a motor loses on the robot's own bus in a second
_SECOND: Final = 1000  # ms
_REMOTE_OFF: Final = write_remote(RemoteReading(False, frozenset()))
_IDLE: Final = write_remote(RemoteReading(True, frozenset()))


class RobotCondition:
    """Counter, battery, remote control and motors of one robot.

    Its counter counts milliseconds, as those of Unitree's simulators do, from a number that means
    nothing.

    Attributes:
        off: whether it is switched off.

    Args:
        seed: of its chance.
    """

    def __init__(self, seed: Sequence[int]) -> None:
        self._chance = np.random.default_rng(tuple(seed))
        self._first = int(self._chance.integers(_COUNTER))  # what its counter says at tick 0
        self._lost = np.zeros(N_JOINTS, dtype=np.int64)
        self._charge, self._charged_at = FULL, 0  # %, ms
        self._battery = _battery(FULL)
        self._second = 0  # ms, when what changes slowly is looked at again
        self._remote = _IDLE
        self._idle_at: int | None = None  # tick
        self.off = False
        self._protected = list[int]()  # motors that have switched themselves off
        self._asked: MotorTargets | None = None  # of what the motors follow
        self._followed: Command | None = None

    def switch_on(self, now: int) -> None:
        """Switch it on, and have its counter begin anew."""
        if self.off:
            self.off, self._first = False, -now

    def set_charge(self, percent: float, now: int) -> None:
        """Give the battery this charge, %, from which it goes on to drain."""
        self._charge, self._charged_at = percent, now
        self._battery = _battery(percent)

    def protect(self, joint: int) -> None:
        """Have a motor switch itself off until all is cleared; its index in `JOINT_NAMES`."""
        self._protected.append(joint)
        self._asked = None

    def press(self, buttons: frozenset[str], until: int | None) -> None:
        """Press these buttons of the remote control alone, until a tick, ms; None: for good."""
        self._remote, self._idle_at = write_remote(RemoteReading(True, buttons)), until

    def switch_remote_off(self) -> None:
        """Have the remote control say nothing."""
        self._remote, self._idle_at = _REMOTE_OFF, None

    def clear(self, now: int) -> None:
        """Be as it was when it was switched on; its counters go on."""
        self.switch_on(now)
        self._protected.clear()
        self._asked = None
        self.set_charge(FULL, now)
        self.press(frozenset(), None)

    def report(self, state: State, heat: Array, targets: MotorTargets | None) -> RobotReport:
        """What a robot says of a tick.

        Args:
            state: what its sensors measure.
            heat: of the motors, (12,), 1 where continuous torque leads.
            targets: what the motors do; None: they are off.
        """
        now = state.tick
        if self._idle_at is not None and now >= self._idle_at:
            self._remote, self._idle_at = _IDLE, None
        if now >= self._second:
            self._pass_a_second(now)
        return RobotReport(
            tick=(self._first + now) % _COUNTER,
            quat_wxyz=state.imu_quat_wxyz,
            gyro=state.imu_gyro,
            accel=state.imu_accel,
            q=state.q_joint,
            dq=state.v_joint,
            tau=state.tau_joint,
            foot=state.foot_force,
            mode=self._mode(targets),
            temperature=_COLD + _WARMER * heat,
            lost=self._lost,
            imu_temperature=_IMU_TEMPERATURE,
            remote=self._remote,
            battery=self._battery,
        )

    def command(self, targets: MotorTargets | None) -> Command | None:
        """What the world's motors do under a robot's command; None if all are off."""
        if self.off or targets is None:
            return None
        if targets is not self._asked:
            self._asked, self._followed = targets, self._followed_by(targets)
        return self._followed

    def _followed_by(self, targets: MotorTargets) -> Command | None:
        on = targets.mode != OFF
        if not on.any():
            return None
        if self._protected:
            on[self._protected] = False
        share = on.astype(float)
        # Where nothing is asked for, an angle or a rate is a huge number, with a gain of zero.
        q = np.where(targets.kp > 0.0, targets.q, 0.0)
        dq = np.where(targets.kd > 0.0, targets.dq, 0.0)
        return Command(0, 0, share * targets.tau, q, dq, share * targets.kp, share * targets.kd)

    def _mode(self, targets: MotorTargets | None) -> NDArray[np.uint8]:
        mode = np.full(N_JOINTS, OFF, np.uint8) if targets is None else targets.mode
        if self._protected:
            mode = mode.copy()
            mode[self._protected] = PROTECTED
        return mode

    def _pass_a_second(self, now: int) -> None:
        self._second = now + _SECOND
        self._lost = self._lost + self._chance.poisson(_LOST, N_JOINTS)
        self._battery = _battery(max(0.0, self._charge - _DRAIN * (now - self._charged_at)))


def _battery(charge: float) -> Battery:
    volts = _EMPTY_V + (_FULL_V - _EMPTY_V) * charge / 100.0
    return Battery(math.ceil(charge), _CURRENT, volts)
