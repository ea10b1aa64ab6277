"""SHELL of the test of a hanging robot's joints; it joins no team."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.bridges.driver import RobotDriver
from quadriga.bridges.guard import Guard
from quadriga.bridges.joint_motion import moving_joint
from quadriga.bridges.joint_verdicts import JointSample, JointVerdict, judge_joints
from quadriga.bridges.modes import BridgeMode, Wish
from quadriga.bridges.robot_loop import TICK, RobotLoop
from quadriga.bridges.supervisor import Supervised
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import CheckError
from quadriga.shared.robot.conventions import JOINT_NAMES, Array
from quadriga.shared.robot.motions import Motion
from quadriga.shared.runtime.clock import Rate
from quadriga.shared.unitree.packets import MotorTargets, RobotReport

_STRAYS: Final = "joint-strays"


class JointTester:
    """One hanging robot whose joints move, one after the other.

    Args:
        config: the team's configuration.
        name: of the robot.
        driver: the way to it.
        guard: brings the robot to rest when this process dies or hangs.
        say: tells the operator what happens.
    """

    def __init__(
        self,
        config: Config,
        name: str,
        driver: RobotDriver,
        guard: Guard,
        say: Callable[[str], None],
    ) -> None:
        self._name, self._say = name, say
        self._loop = RobotLoop(config, name, driver, guard=guard, say=say)
        self._motion: Motion | None = None
        self._samples: list[JointSample] = []
        self._sampled_at = -1  # ms

    def run(self, stopped: Callable[[], bool]) -> list[JointVerdict]:
        """Test all joints, damp them, and leave; the verdicts, fewer if `stopped()` came first.

        Raises:
            CheckError: the robot is not as it must be.
            BridgeError: its own controller does not let go of the motors.
        """
        try:
            if self._loop.look(stopped, hung=True):
                self._loop.take_charge()
                self._move(stopped)
        finally:
            self._loop.leave()
        return [] if self._motion is None else judge_joints(self._samples, self._motion)

    def refuse_stopped(self) -> None:
        """Name what the robot has stopped for.

        Raises:
            CheckError: it has stopped.
        """
        reason, motion = self._loop.memory.reason, self._motion
        if not reason:
            return
        joint = None
        if motion is not None and self._samples:
            joint = moving_joint(motion, self._samples[-1].seconds)
        cause = ""
        if reason.startswith(_STRAYS):
            cause = "order of legs or joints, or the sign or the zero of its angle"
        expected = "joints that stay where they are"
        if joint is not None:
            expected = f"{JOINT_NAMES[joint]} alone to move"
        raise CheckError(f"robot {self._name}: test of joints", reason, expected, cause)

    def _move(self, stopped: Callable[[], bool]) -> None:
        rate, began, joint = Rate(TICK, slack=3.0), False, None
        while not stopped() and not (began and self._loop.mode is not BridgeMode.TESTING):
            supervised = self._loop.turn(None, Wish.TEST)
            if self._loop.mode is BridgeMode.STOPPED:
                return
            if supervised is not None and self._loop.mode is BridgeMode.TESTING:
                began = True
                joint = self._note(supervised, joint)
            rate.wait()

    def _note(self, supervised: Supervised, before: int | None) -> int | None:
        """Keep what is asked and measured; which joint moves now."""
        memory, report = self._loop.memory, self._loop.report
        if memory.motion is None or report is None or supervised.targets is None:
            return before
        self._motion = memory.motion
        seconds = (self._loop.now - memory.since) / 1000.0
        if self._loop.report_at > self._sampled_at:
            self._sampled_at = self._loop.report_at
            self._samples.append(_sample(seconds, supervised.targets, memory.torque, report))
        joint = moving_joint(memory.motion, seconds)
        if joint is not None and joint != before:
            self._say(f"{self._name}: {JOINT_NAMES[joint]} moves")
        return joint


def _sample(
    seconds: float, asked: MotorTargets, torque_asked: Array, report: RobotReport
) -> JointSample:
    return JointSample(seconds, asked.q, torque_asked, report.q, report.dq, report.tau, report.gyro)
