"""What a bridge lets its robot do: nine states, a command a millisecond, every reason to stop.

The supervisor knows no agent, bus or socket. It is told what the robot last said, what the agent
last asked for and how old both are, and it gives the command that may be sent.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from quadriga.bridges.limits import joint_limits, limit_targets, shares_of_speed
from quadriga.bridges.postures import (
    SINKING,
    TORQUE,
    damped,
    joint_motion,
    led_gently,
    passive,
    stay,
    towards,
    tracking_error,
)
from quadriga.shared import modes
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import BridgeConfig
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import JOINT_NAMES, N_JOINTS, N_LEGS, Array
from quadriga.shared.robots.motions import Motion, posture_at, way_down, way_up
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.runtime.record import record
from quadriga.shared.unitree.packets import PROTECTED, MotorTargets, RobotReport, asks_to_stop

TRACKING_ERROR: Final = "tracking-error"  # why a test of joints is stopped
_HOTTER: Final = 8.0  # °C above `temperature_max` that stop a robot: its motors end at 10 more
_RELEASING: Final = 1.0  # s, for which a robot that has lain down is damped


class BridgeMode(StrEnum):
    """What a bridge does with its robot: modes of `shared.modes`, and three of its own."""

    DRY = "dry"  # no motor is ever enabled
    PASSIVE = modes.PASSIVE  # motors off
    STANDING_UP = modes.STANDING_UP
    STAND = modes.STAND
    WALK = modes.WALK  # the agent's commands, limited
    LYING_DOWN = modes.LYING_DOWN
    TESTING = "testing"  # it hangs, and one joint after the other moves a little
    RELEASING = "releasing"  # damped, then passive
    ESTOP = modes.ESTOP  # damped, then motors off, until the bridge is started again


class Request(StrEnum):
    """What the team, or a test, wants of the robot."""

    REST = "rest"
    STAND = "stand"
    WALK = "walk"
    LIE = "lie"
    TEST = "test"


_UPRIGHT: Final = (BridgeMode.STANDING_UP, BridgeMode.STAND, BridgeMode.WALK)
BY_REQUEST: Final[Mapping[tuple[BridgeMode, Request], BridgeMode]] = MappingProxyType(
    {
        (BridgeMode.PASSIVE, Request.STAND): BridgeMode.STANDING_UP,
        (BridgeMode.PASSIVE, Request.TEST): BridgeMode.TESTING,
        (BridgeMode.STAND, Request.WALK): BridgeMode.WALK,
        **{(mode, Request.LIE): BridgeMode.LYING_DOWN for mode in _UPRIGHT},
        **{(BridgeMode.TESTING, request): BridgeMode.RELEASING for request in Request},
        (BridgeMode.TESTING, Request.TEST): BridgeMode.TESTING,
    }
)
"""The state that a request leads to; from any other nothing changes."""

BY_ITSELF: Final[Mapping[BridgeMode, BridgeMode]] = MappingProxyType(
    {
        BridgeMode.STANDING_UP: BridgeMode.STAND,
        BridgeMode.LYING_DOWN: BridgeMode.RELEASING,
        BridgeMode.TESTING: BridgeMode.RELEASING,
        BridgeMode.RELEASING: BridgeMode.PASSIVE,
    }
)
"""The state that follows when a motion is over."""


@record
class SupervisorState:
    """What a supervisor remembers.

    Attributes:
        mode: which of the nine.
        reason: why it is stopped; "" otherwise.
        since: when the mode began, ms.
        motion: that the bridge makes itself.
        held: angles at which the joints are held while the agent is late, (12,).
        torque: of the last command, (12,), N·m.
        sent: when it was, ms.
        fast_ms: for how long some joint has been too fast, or its sensor wrong.
    """

    mode: BridgeMode
    reason: str
    since: int
    motion: Motion | None
    held: Array | None
    torque: Array
    sent: int
    fast_ms: int = 0


@record
class SupervisorInputs:
    """What a supervisor is told, once a millisecond.

    Attributes:
        now: ms.
        report: the robot's newest.
        report_age: ms since it came.
        command: the agent's newest; None before the first.
        command_age: ms.
        request: of the team.
        writers: how many others have commanded the robot's motors since the step before.
        stall: ms since the step before, by the clock.
        watched: whether the bridge's watchdog is there.
        estop: why the team's emergency stop was pressed; "" if it was not.
    """

    now: int
    report: RobotReport
    report_age: int
    command: Command | None = None
    command_age: int = 0
    request: Request = Request.REST
    writers: int = 0
    stall: int = 1
    watched: bool = True
    estop: str = ""


class Supervised(NamedTuple):
    """What comes of a step.

    Attributes:
        targets: to send; None: nothing may be sent.
        changes: modes that began, each with the reason, in their order.
        cut: names of the limits that were applied.
    """

    targets: MotorTargets | None
    changes: tuple[tuple[BridgeMode, str], ...]
    cut: tuple[str, ...]


class Supervisor:
    """The rules for one robot; `step` depends on its arguments alone.

    Args:
        robot: of this kind.
        config: the limits.
        servo: the motors' mode in which they follow commands.
    """

    def __init__(self, robot: RobotSpec, config: BridgeConfig, servo: int) -> None:
        self._robot, self._config, self._servo = robot, config, servo
        self._limits = joint_limits(config, robot)
        self._warm = np.tile(robot.temperature_max, N_LEGS)
        self._gentle = self._limits._replace(torque=np.minimum(TORQUE, self._limits.torque))
        self._fastest = config.speed_share * np.tile(robot.speed, 4)
        # Compiled, or loaded, now and not in the first millisecond.
        zero = np.zeros(N_JOINTS)
        limit_targets(passive(zero), zero, zero, zero, 1, self._limits)
        shares_of_speed(zero, zero, self._fastest, self._limits)

    def initial(self, now: int, *, armed: bool) -> SupervisorState:
        """Dry, or passive if it may command the robot."""
        mode = BridgeMode.PASSIVE if armed else BridgeMode.DRY
        return SupervisorState(mode, "", now, None, None, np.zeros(N_JOINTS), now)

    def step(
        self, state: SupervisorState, inputs: SupervisorInputs
    ) -> tuple[SupervisorState, Supervised]:
        """Decide the mode, and the command of this millisecond."""
        if state.mode is BridgeMode.DRY:
            return state, Supervised(None, (), ())
        before, state = state, self._change(self._note_rates(state, inputs), inputs)
        changes = () if state.mode is before.mode else ((state.mode, state.reason),)
        state, targets = self._command(state, inputs)
        limits = self._gentle if state.mode is BridgeMode.TESTING else self._limits
        report, ms = inputs.report, max(1, inputs.now - state.sent)
        limited = limit_targets(targets, report.q, report.dq, state.torque, ms, limits)
        state = replace(state, torque=limited.torque, sent=inputs.now)
        return state, Supervised(limited.targets, changes, limited.cut)

    def _change(self, state: SupervisorState, inputs: SupervisorInputs) -> SupervisorState:
        """The state with the mode of this millisecond."""
        if state.mode is BridgeMode.ESTOP:
            return state
        if reason := self.reason_to_stop(state, inputs):
            return _begin(state, BridgeMode.ESTOP, inputs.now, reason)
        if state.mode is BridgeMode.TESTING and (
            joint := tracking_error(inputs.report.q, self._posture(state, inputs)[0])
        ):
            reason = with_detail(TRACKING_ERROR, joint)
            return _begin(state, BridgeMode.ESTOP, inputs.now, reason)
        mode = BY_REQUEST.get((state.mode, inputs.request), state.mode)
        if mode is BridgeMode.WALK and not self._is_fresh(inputs):
            return state
        if mode is state.mode and self._is_over(state, inputs):
            mode = BY_ITSELF.get(mode, mode)
        if mode is state.mode:
            return state
        return _begin(state, mode, inputs.now, motion=self._motion(mode, inputs.report.q))

    def _motion(self, mode: BridgeMode, q: Array) -> Motion | None:
        """The motion that a mode makes from measured angles, if it makes one."""
        match mode:
            case BridgeMode.STANDING_UP:
                return way_up(q, self._robot, self._config.stand_s)
            case BridgeMode.LYING_DOWN:
                return way_down(q, self._robot, self._config.stand_s)
            case BridgeMode.TESTING:
                return joint_motion(q, self._robot)
            case BridgeMode.RELEASING:
                return stay(q, _RELEASING)
        return None

    def _note_rates(self, state: SupervisorState, inputs: SupervisorInputs) -> SupervisorState:
        """The state with the time for which some joint has been too fast, or cannot be believed."""
        if self._shares_of_speed(inputs.report).max() <= 1.0:
            return state if state.fast_ms == 0 else replace(state, fast_ms=0)
        return replace(state, fast_ms=state.fast_ms + max(1, inputs.now - state.sent))

    def _shares_of_speed(self, report: RobotReport) -> Array:
        return shares_of_speed(report.q, report.dq, self._fastest, self._limits)

    def reason_to_stop(self, state: SupervisorState, inputs: SupervisorInputs) -> str:
        """Why the robot must stop now, "" if it need not."""
        config, report, mode = self._config, inputs.report, state.mode
        if inputs.estop:
            return with_detail("estop", inputs.estop)
        if asks_to_stop(report.remote):
            return with_detail("remote", "L2+B")
        # Once the watchdog has damped the motors, it is who else has commanded them.
        if inputs.stall > config.damp_ms and mode is not BridgeMode.PASSIVE:
            return with_detail("bridge-late", f"{inputs.stall} ms")
        if not inputs.watched:
            return "watchdog-gone"
        if inputs.writers:
            return with_detail("second-writer", f"{inputs.writers} others command the motors")
        if mode is BridgeMode.PASSIVE:
            return ""
        if inputs.report_age > config.report_max_ms:
            return with_detail("report-late", f"{inputs.report_age} ms")
        if mode is BridgeMode.WALK and inputs.command_age > config.damp_ms:
            return with_detail("command-late", f"{inputs.command_age} ms")
        if state.fast_ms > config.speed_ms:
            shares = self._shares_of_speed(report)
            joint = int(np.argmax(shares))
            code = "speed" if math.isfinite(shares[joint]) else "joint-reading"
            measured = f"{report.q[joint]:.2f} rad, {report.dq[joint]:.1f} rad/s"
            return with_detail(code, f"{JOINT_NAMES[joint]} {measured}")
        return self._reason_of_the_body(report)

    def _reason_of_the_body(self, report: RobotReport) -> str:
        config = self._config
        if (tilt := tilt_of(report.quat_wxyz)) > config.tilt_max:
            return with_detail("tilt", f"{tilt:.2f} rad")
        if (off := np.flatnonzero(report.mode == PROTECTED)).size:
            return with_detail("motor-protected", JOINT_NAMES[off[0]])
        if heat := self._above(report, _HOTTER):
            return with_detail("temperature", heat)
        battery = report.battery
        if battery is not None and battery.charge < config.battery_min / 2:
            return with_detail("battery", f"{battery.charge} %")
        return ""

    def warning(self, report: RobotReport) -> str:
        """What will soon stop the robot, "" if nothing will."""
        heat = self._above(report, 0.0)
        return heat and with_detail("hot", heat)

    def _above(self, report: RobotReport, more: float) -> str:
        """The motor that is farthest above its limit and `more`, °C; "" if none is."""
        above = report.temperature - self._warm
        joint = int(np.argmax(above))
        if above[joint] <= more:
            return ""
        stop = self._warm[joint] + _HOTTER
        return f"{JOINT_NAMES[joint]} {report.temperature[joint]:.0f} °C, {stop:.0f} °C stop it"

    def _command(
        self, state: SupervisorState, inputs: SupervisorInputs
    ) -> tuple[SupervisorState, MotorTargets]:
        """What the mode asks of the motors, before it is limited."""
        q = inputs.report.q
        match state.mode:
            case BridgeMode.PASSIVE:
                return state, passive(q)
            case BridgeMode.ESTOP:
                off = inputs.now - state.since > 1000.0 * self._config.passive_s
                return state, passive(q) if off else damped(q, self._servo)
            case BridgeMode.WALK:
                return self._follow(state, inputs)
            case BridgeMode.STAND:
                return state, self._hold(self._robot.q_stand)
            case BridgeMode.RELEASING:
                return state, damped(q, self._servo, SINKING)
            case BridgeMode.TESTING:
                now = self._seconds(state, inputs)
                return state, led_gently(*self._posture(state, inputs), self._servo, now)
        return state, towards(*self._posture(state, inputs), self._servo, self._config)

    def _hold(self, q: Array) -> MotorTargets:
        """The command that holds the joints at these angles."""
        return towards(q, np.zeros(N_JOINTS), self._servo, self._config)

    def _posture(self, state: SupervisorState, inputs: SupervisorInputs) -> tuple[Array, Array]:
        """Angles and rates of the motion now, (12,) each, rad and rad/s."""
        if state.motion is None:
            raise ValueError(f"no motion while {state.mode}")
        return posture_at(state.motion, self._seconds(state, inputs))

    def _follow(
        self, state: SupervisorState, inputs: SupervisorInputs
    ) -> tuple[SupervisorState, MotorTargets]:
        """The agent's command, or the joints held where they were when it became late."""
        command = inputs.command
        if command is not None and self._is_fresh(inputs):
            servos = np.full(N_JOINTS, self._servo, dtype=np.uint8)
            targets = MotorTargets(
                servos, command.q_des, command.v_des, command.tau, command.kp, command.kd
            )
            return (state if state.held is None else replace(state, held=None)), targets
        if state.held is None:
            state = replace(state, held=inputs.report.q.copy())
        return state, self._hold(np.asarray(state.held))

    def _is_fresh(self, inputs: SupervisorInputs) -> bool:
        return inputs.command is not None and inputs.command_age <= self._config.hold_ms

    def _seconds(self, state: SupervisorState, inputs: SupervisorInputs) -> float:
        return (inputs.now - state.since) / 1000.0

    def _is_over(self, state: SupervisorState, inputs: SupervisorInputs) -> bool:
        return state.motion is not None and self._seconds(state, inputs) >= state.motion.seconds


def _begin(
    state: SupervisorState,
    mode: BridgeMode,
    now: int,
    reason: str = "",
    motion: Motion | None = None,
) -> SupervisorState:
    return replace(state, mode=mode, reason=reason, since=now, motion=motion, held=None)


def tilt_of(quat_wxyz: Array) -> float:
    """Angle between the trunk's z axis and the vertical, rad; of no attitude: π."""
    w, x, y, z = quat_wxyz.tolist()
    square = w * w + x * x + y * y + z * z
    if not square > 0.25:
        return math.pi
    return math.acos(min(1.0, max(-1.0, 1.0 - 2.0 * (x * x + y * y) / square)))
