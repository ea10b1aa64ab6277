"""SHELL of the test of a hanging robot's joints, and the verdicts on them; it joins no team."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from quadriga.bridges.drivers import RobotDriver, open_driver
from quadriga.bridges.plant import TICK, RobotPlant, say
from quadriga.bridges.postures import WAY, moving_joint
from quadriga.bridges.supervisor import TRACKING_ERROR, BridgeMode, Request, Supervised
from quadriga.bridges.watchdog import Watchdog
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import CheckError
from quadriga.shared.robots.conventions import JOINT_NAMES, N_JOINTS, Array
from quadriga.shared.robots.motions import Motion
from quadriga.shared.runtime.clock import Rate

_MOVED: Final = 0.5  # of the way that is asked for: with less a joint has not moved
_STILL: Final = 0.25  # likewise, that another joint may move
_BEFORE: Final = 0.1  # s, in which a joint's place before its motion is measured
_AROUND: Final = 0.03  # s, around the turning point
_SLOPE: Final = (0.5, 1.5)  # of the measured rate on the derivative of the angle
_SPAN: Final = 0.02  # s, over which that derivative is taken
_TORQUE_OFF: Final = (1.5, 0.6)  # N·m, and share of the torque asked for, that is measured else
_TORQUE_ASKED: Final = 0.4  # N·m at most, from which on the measured torque is judged
_CALM: Final = 1.0  # rad/s that the trunk may turn


class JointTester:
    """One hanging robot whose joints move, one after the other; arguments as of `RobotPlant`."""

    def __init__(self, config: Config, name: str, driver: RobotDriver, watchdog: Watchdog) -> None:
        self._name = name
        self._plant = RobotPlant(config, name, driver, watchdog=watchdog, say=say)
        self._motion: Motion | None = None
        self._samples: list[JointSample] = []
        self._sampled_at = -1  # ms
        self._joint: int | None = None  # that moves now

    def run(self, stopped: Callable[[], bool]) -> list[JointVerdict]:
        """Test all joints, damp them, and leave; the verdicts, fewer if `stopped()` came first.

        Raises:
            CheckError: the robot is not as it must be.
            BridgeError: its own controller does not let go of the motors.
        """
        plant = self._plant
        try:
            if plant.look(stopped, hung=True):
                plant.take_charge()
                rate = Rate(TICK, slack=3.0)
                while not stopped() and plant.mode in (BridgeMode.PASSIVE, BridgeMode.TESTING):
                    supervised = plant.turn(Request.TEST)
                    if supervised is not None and plant.mode is BridgeMode.TESTING:
                        self._note(supervised)
                    rate.wait()
        finally:
            plant.finish()
        return [] if self._motion is None else judge_joints(self._samples, self._motion)

    def _note(self, supervised: Supervised) -> None:
        """Keep what is asked and measured, and say which joint moves."""
        state, r, asked = self._plant.supervision, self._plant.report, supervised.targets
        if state.motion is None or r is None or asked is None:
            return
        self._motion, seconds = state.motion, (self._plant.now - state.since) / 1000.0
        if self._plant.report_at > self._sampled_at:
            self._sampled_at = self._plant.report_at
            sample = JointSample(np.array(seconds), asked.q, state.torque, r.q, r.dq, r.tau, r.gyro)
            self._samples.append(sample)
        before, self._joint = self._joint, moving_joint(state.motion, seconds)
        if self._joint is not None and self._joint != before:
            say(f"{self._name}: {JOINT_NAMES[self._joint]} moves")

    def refuse_stopped(self) -> None:
        """Name what the robot has stopped for.

        Raises:
            CheckError: it has stopped.
        """
        if not (reason := self._plant.supervision.reason):
            return
        cause, expected = "", "joints that stay where they are"
        if reason.startswith(TRACKING_ERROR):
            cause = "order of legs or joints, or the sign or the zero of its angle"
        if self._joint is not None:
            expected = f"{JOINT_NAMES[self._joint]} alone to move"
        raise CheckError(f"robot {self._name}: test of joints", reason, expected, cause)


def build_joint_tester(config: Config, name: str) -> JointTester:
    """The test of the joints of the robot of this name.

    Raises:
        ConfigError: no address or interface that can be used.
        BridgeError: the way to the robot cannot be opened.
    """
    kind, bridge = config.team.robot, config.bridge.of_robot(name)
    return JointTester(config, name, open_driver(kind, bridge), Watchdog(kind, bridge))


class JointSample(NamedTuple):
    """What was asked of the joints at one moment of the test, and what they reported.

    All moments of a test are one of these, too, whose arrays have a row for each.
    """

    seconds: Array  # since the test began
    asked: Array  # angles, (12,), rad
    torque_asked: Array  # (12,), N·m
    q: Array  # measured, as all that follows, (12,), rad
    dq: Array  # (12,), rad/s
    tau: Array  # (12,), N·m
    gyro: Array  # of the trunk, (3,), rad/s


class JointVerdict(NamedTuple):
    """How one joint moved."""

    joint: str  # its name
    asked: float  # the way to its turning point, rad
    moved: float  # the way that it reports, rad
    error: float  # the most that it was off its way, rad
    torque: float  # the most that it measured, N·m
    wrong: str = ""  # what is not right; "" if all is
    cause: str = ""  # the likely cause of that


def judge_joints(samples: Sequence[JointSample], motion: Motion) -> list[JointVerdict]:
    """The verdicts on all joints whose `joint_motion` was made to its end."""
    if not samples:
        return []
    log = JointSample(*(np.array(column) for column in zip(*samples, strict=True)))
    ends = motion.ends[: 3 * N_JOINTS].reshape(N_JOINTS, 3).tolist()
    return [_judge(k, log, *ends[k]) for k in range(N_JOINTS) if log.seconds[-1] >= ends[k][2]]


def _judge(k: int, log: JointSample, begin: float, turn: float, end: float) -> JointVerdict:
    during = JointSample(*(column[(log.seconds >= begin) & (log.seconds < end)] for column in log))
    before = (log.seconds >= begin - _BEFORE) & (log.seconds < begin)
    turning = np.abs(log.seconds - turn) <= _AROUND
    name = JOINT_NAMES[k]
    if not (before.any() and turning.any() and len(during.seconds) > 2):
        return JointVerdict(name, WAY, 0.0, 0.0, 0.0, "no reports", "the cable, or the network")
    q_before = log.q[before].mean(axis=0)
    moved = log.q[turning].mean(axis=0) - q_before
    asked = during.asked[:, k] - during.asked[0, k]
    way = float(asked[np.argmax(np.abs(asked))])
    error = float(np.max(np.abs(during.q[:, k] - q_before[k] - asked)))
    torque = float(during.tau[np.argmax(np.abs(during.tau[:, k])), k])
    wrong, cause = _what_is_wrong(k, moved, way, during)
    if not wrong and error > _MOVED * abs(way):
        wrong = f"off its way by {error:.2f} rad"
        cause = "something holds it, or its motor is weak"
    return JointVerdict(name, way, float(moved[k]), error, torque, wrong, cause)


def _what_is_wrong(k: int, moved: Array, way: float, during: JointSample) -> tuple[str, str]:
    """The first thing that is wrong with joint k, and its likely cause; two times "" if none is."""
    share = moved[k] / way
    others = np.abs(moved) / abs(way)
    others[k] = 0.0
    other = int(np.argmax(others))
    if share < _MOVED and others[other] >= _MOVED:
        order = "order of legs" if k % 3 == other % 3 else "order of joints"
        return f"{JOINT_NAMES[other]} moved by {moved[other]:+.2f} rad", order
    if share <= -_MOVED:
        return "it moved the other way", "the sign of its angle, or of its command"
    if share < _MOVED:
        if np.max(np.abs(during.tau[:, k])) < 0.5 * np.max(np.abs(during.torque_asked[:, k])):
            return "it did not move", "its motor gives no torque: off, or its cable"
        return "it did not move", "something holds it, or it is at its end stop"
    if others[other] > _STILL:
        text = f"{JOINT_NAMES[other]} moved too, by {moved[other]:+.2f} rad"
        return text, "it is pushed, or its motor gives no torque"
    return _numbers_of(k, during)


def _numbers_of(k: int, during: JointSample) -> tuple[str, str]:
    """Whether rate, torque and gyro fit the motion."""
    period = float(during.seconds[-1] - during.seconds[0]) / (len(during.seconds) - 1)
    span = max(1, round(_SPAN / period))
    q, seconds = during.q[:, k], during.seconds
    if len(seconds) > 2 * span:
        derivative = (q[2 * span :] - q[: -2 * span]) / (seconds[2 * span :] - seconds[: -2 * span])
        square = max(float(derivative @ derivative), 1e-9)
        slope = float(during.dq[span:-span, k] @ derivative) / square
        if not _SLOPE[0] <= slope <= _SLOPE[1]:
            cause = "its sign" if slope < -_SLOPE[0] else "its unit, or the order of rates"
            return f"its rate is {slope:.1f} times the change of its angle", cause
    asked, measured = during.torque_asked[:, k], during.tau[:, k]
    off = float(np.mean(np.abs(measured - asked)))
    if float(np.max(np.abs(asked))) >= _TORQUE_ASKED:
        if float(measured @ asked) < -0.5 * float(asked @ asked):
            return "its torque has the other sign", "the sign of its torque"
        if off > _TORQUE_OFF[0] + _TORQUE_OFF[1] * float(np.mean(np.abs(asked))):
            text = f"its torque is off by {off:.1f} N·m on average"
            return text, "the unit or the order of torques, or friction"
    turned = float(np.max(np.linalg.norm(during.gyro, axis=1)))
    if turned > _CALM:
        return f"the trunk turned at {turned:.1f} rad/s", "it swings: hang it up more firmly"
    return "", ""


def refuse_wrong(name: str, verdicts: Sequence[JointVerdict]) -> None:
    """Name the first joint that is not right.

    Raises:
        CheckError: one is not, or not all have been tested.
    """
    for verdict in verdicts:
        if verdict.wrong:
            raise CheckError(
                f"robot {name}: {verdict.joint}",
                verdict.wrong,
                f"this joint alone to move by {verdict.asked:+.2f} rad",
                verdict.cause,
            )
    if len(verdicts) < N_JOINTS:
        raise CheckError(f"robot {name}: test", f"{len(verdicts)} joints", f"all {N_JOINTS}")


def table(verdicts: Sequence[JointVerdict]) -> str:
    """The verdicts in lines: joint, asked, moved, error, torque, verdict."""
    lines = [f"{'joint':<15}{'asked':>8}{'moved':>8}{'error':>8}{'torque':>8}  verdict"]
    lines.append(f"{'':<15}{'rad':>8}{'rad':>8}{'rad':>8}{'N·m':>8}")
    for v in verdicts:
        numbers = f"{v.asked:>+8.2f}{v.moved:>+8.2f}{v.error:>8.2f}{v.torque:>+8.1f}"
        lines.append(f"{v.joint:<15}{numbers}  {v.wrong or 'right'}")
    return "\n".join(lines)
