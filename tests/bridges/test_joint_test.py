"""The test of joints passes a sound robot, and names what is planted in one that is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar
from unittest.mock import MagicMock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.bridges.drivers import RobotDriver
from quadriga.bridges.joint_test import JointTester, JointVerdict, refuse_wrong, table
from quadriga.bridges.postures import TORQUE, WAY, joint_motion, moving_joint, passive
from quadriga.bridges.supervisor import BridgeMode, Request, Supervisor, SupervisorInputs
from quadriga.shared.errors import CheckError
from quadriga.shared.robots.conventions import JOINT_NAMES, Array
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.unitree.packets import OFF, SERVO, MotorTargets, RobotReport
from tests.bridges.robots import config_of, pressing, standing

CONFIG = config_of()
SUPERVISOR = Supervisor(CONFIG.robot, CONFIG.bridge, SERVO)
HANGING = np.tile([0.0, 0.8, -1.5], 4)
INERTIA, FRICTION, GRAVITY = 0.05, 0.3, 4.0  # kg·m², N·m·s/rad, N·m/rad about where a leg hangs
Commands = Callable[[MotorTargets], MotorTargets]
Reports = Callable[[RobotReport], RobotReport]


class Hanging(RobotDriver):
    """Twelve joints, each a pendulum with a motor of its own, behind what is planted."""

    servo, packets_ms = SERVO, 2

    def __init__(self, commands: Commands, reports: Reports) -> None:
        super().__init__()
        self._commands, self._reports = commands, reports
        self.q, self.dq, self.tau = HANGING.copy(), np.zeros(12), np.zeros(12)
        self.ms, self._told, self._targets = 0, 0, passive(HANGING)

    def wait(self) -> None:
        """Let a millisecond pass, at once."""
        t = self._targets
        self.tau = t.tau + t.kp * (t.q - self.q) + t.kd * (t.dq - self.dq)
        self.tau = np.where(t.mode == OFF, 0.0, self.tau)
        force = self.tau - GRAVITY * (self.q - HANGING) - FRICTION * self.dq
        self.dq = self.dq + 1e-3 * force / INERTIA
        self.q = self.q + 1e-3 * self.dq
        self.ms += 1

    def receive(self) -> RobotReport | None:
        if self.ms - self._told < self.packets_ms:
            return None
        self._told = self.ms
        self.counters["received"] += 1
        q, dq, tau = self.q.copy(), self.dq.copy(), self.tau.copy()
        return self._reports(standing(CONFIG, tick=self.ms, q=q, dq=dq, tau=tau))

    def send(self, targets: MotorTargets) -> None:
        self._targets = self._commands(targets)

    def close(self) -> None: ...


class Outcome(NamedTuple):
    """What came of a test."""

    verdicts: list[JointVerdict]
    mode: BridgeMode
    reason: str
    torque: float


def outcome_of(commands: Commands = lambda t: t, reports: Reports = lambda r: r) -> Outcome:
    robot, watchdog = Hanging(commands, reports), MagicMock()
    with pytest.MonkeyPatch.context() as patch:
        for module in ("plant", "joint_test"):
            patch.setattr(f"quadriga.bridges.{module}.Rate", lambda *_, **__: robot)
        tester = JointTester(CONFIG, "r1", robot, watchdog)
        plant = tester._plant
        plant._clock, plant._turned_at = lambda: 1e-3 * robot.ms, 0.0
        verdicts = tester.run(bool)
    torque = max(float(np.abs(sample.torque_asked).max()) for sample in tester._samples)
    return Outcome(verdicts, plant.mode, plant.supervision.reason, torque)


def swapped(values: Array) -> Array:
    """Legs FL and FR in each other's place."""
    return values[[3, 4, 5, 0, 1, 2, *range(6, 12)]]


def turned(values: Array) -> Array:
    """The sign of FR's thigh turned."""
    return np.where(np.arange(12) == 4, -values, values)


Packet = TypeVar("Packet", MotorTargets, RobotReport)


def change(how: Callable[[Array], Array], *names: str) -> Callable[[Packet], Packet]:
    """What changes these fields of each packet that passes."""

    def changed(packet: Packet) -> Packet:
        fields: dict[str, Any] = {name: how(getattr(packet, name)) for name in names}
        return replace(packet, **fields)

    return changed


def off(values: Array) -> Array:
    """Nothing for RL's calf."""
    return np.where(np.arange(12) == 8, 0.0, values)


def test_a_sound_robot_passes_and_is_passive_at_the_end() -> None:
    sound = outcome_of()
    refuse_wrong("r1", sound.verdicts)
    assert (sound.mode, sound.reason) == (BridgeMode.PASSIVE, "")
    assert [v.joint for v in sound.verdicts] == list(JOINT_NAMES)
    assert all(abs(v.moved - v.asked) < 0.3 * WAY for v in sound.verdicts)
    assert sound.torque <= TORQUE
    assert all(line.endswith("right") for line in table(sound.verdicts).splitlines()[2:])


PLANTED: tuple[tuple[dict[str, Any], str, str], ...] = (
    ({"commands": change(swapped, "q", "dq", "tau")}, "FL_hip", "order of legs"),
    ({"commands": change(off, "mode")}, "RL_calf", "its motor gives no torque: off, or its cable"),
    ({"reports": change(turned, "dq")}, "FR_thigh", "its sign"),
    ({"reports": change(turned, "tau")}, "FR_thigh", "the sign of its torque"),
)


@pytest.mark.parametrize(("planted", "joint", "cause"), PLANTED)
def test_what_is_planted_is_named(planted: dict[str, Any], joint: str, cause: str) -> None:
    with pytest.raises(CheckError) as caught:
        refuse_wrong("r1", outcome_of(**planted).verdicts)
    assert caught.value.name == f"robot r1: {joint}_joint"
    assert caught.value.cause == cause


def test_a_joint_whose_sign_is_turned_stops_the_test_before_it_is_far() -> None:
    """While the motors come on, softly, it leaves the angle at which it shall stay."""
    found = outcome_of(change(turned, "q", "dq", "tau"))
    assert found.mode is BridgeMode.ESTOP
    assert found.reason.startswith("tracking-error:FR_thigh_joint -0.4")
    with pytest.raises(CheckError, match="robot r1: test: got 0 joints, expected all 12"):
        refuse_wrong("r1", found.verdicts)


@pytest.mark.parametrize("kind", list(ROBOTS))
@given(share=st.floats(0.0, 1.0))
def test_each_joint_has_room_wherever_it_hangs(kind: str, share: float) -> None:
    robot = config_of(kind).robot
    lower, upper = np.array(robot.lower), np.array(robot.upper)
    q = lower + share * (upper - lower)
    motion = joint_motion(q, robot)
    np.testing.assert_allclose(motion.postures[0], q)
    assert (motion.postures[1:] >= lower).all()
    assert (motion.postures[1:] <= upper).all()
    for k in range(12):
        way = motion.postures[2 + 3 * k] - motion.postures[1 + 3 * k]
        np.testing.assert_allclose(np.abs(way), WAY * (np.arange(12) == k))
        assert moving_joint(motion, float(motion.ends[3 * k]) + 0.1) == k
    assert moving_joint(motion, 0.0) is None


def test_a_test_that_is_not_wished_any_more_lets_go_and_the_remote_stops_it() -> None:
    state = SUPERVISOR.initial(0, armed=True)
    hanging = standing(CONFIG, q=HANGING)
    inputs = SupervisorInputs(now=1, report=hanging, report_age=0, request=Request.TEST)
    state, _ = SUPERVISOR.step(state, inputs)
    assert state.mode is BridgeMode.TESTING
    ended, supervised = SUPERVISOR.step(state, replace(inputs, now=2, request=Request.LIE))
    assert ended.mode is BridgeMode.RELEASING
    assert supervised.targets is not None
    np.testing.assert_array_equal(supervised.targets.kp, 0.0)
    pressed = replace(hanging, remote=pressing("L2", "B"))
    stopped, _ = SUPERVISOR.step(state, replace(inputs, now=2, report=pressed))
    assert stopped.mode is BridgeMode.ESTOP
