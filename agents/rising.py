"""A robot that has been down gets up in place, before the whole-body QP takes charge of it.

Its motors had no commands for so long that the plant has led them down: its agent was restarted,
stood still or was cut off. Or its joints were damped, and the operator has released the stop. They
are held where they are until no other robot of the team walks, then led to the stand, with limited
torques. Only once they are there, and the trunk is level, the robot stands.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.modes import (
    COMMANDED,
    DAMPING,
    ESTOP,
    FALL,
    LED_DOWN,
    NO_ESTIMATE,
    NOT_UP,
    REASON_MOST,
    RESET,
    STAND,
    Mode,
    enter_passive,
)
from quadriga.shared.codes import code_of, with_detail
from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.messages import Command, EStop, Reset, State
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.motions import Motion, posture_at, way_up
from quadriga.shared.runtime.record import record

_SECONDS: Final = 1.5  # from lying on folded legs to the stand
_SETTLE_MS: Final = 200  # at the stand, before it is looked at
_LATEST_MS: Final = 1500  # after the motion; then it does not stand
_HOLD: Final = Motion(np.zeros((2, N_JOINTS)), np.array([1.0]))
_SHARE: Final = 0.8  # of the motors' torque that stiffness may ask for
_OFF: Final = 0.25  # rad, that a joint may be off the stand
_LEVEL: Final = math.cos(0.45)  # of the greatest tilt, rad: a robot stands on a steep slope too


@record
class Rise:
    """What an agent remembers while its robot gets up.

    Attributes:
        held: angles at which the joints were when the agent was back, (12,), rad.
        begun: tick at which the motion began; −1: it waits.
        motion: the way up, from the angles at that tick.
    """

    held: Array
    begun: int = -1
    motion: Motion = _HOLD


class RisingStep(NamedTuple):
    """What a tick gives; `rise` is None once the robot no longer gets up."""

    mode: Mode
    rise: Rise | None
    command: Command


class Rising:
    """Fixed data of how one robot gets up; its functions depend on their arguments alone.

    Args:
        config: the team's configuration.
    """

    def __init__(self, config: Config) -> None:
        # A bridge gets its robot up by itself, and in lock-step every command is waited for.
        self._rises = config.team.plant != BRIDGED
        self._is_led_down = self._rises and config.world.mode == "realtime"
        self._away_ms = config.world.command_damp_ms
        # Before the first command the motors are held: while the team stands that will do.
        self._latest_ms = max(self._away_ms, config.gait.stand_ms)
        self._robot = config.robot
        self._kp, self._kd = config.bridge.stand_kp, config.bridge.stand_kd
        self._most_off = _SHARE * config.robot.torque_limit / self._kp  # (12,), rad
        self._fallen_cosine = math.cos(config.controller.fall_tilt)
        self._damping = config.controller.damping

    def why_now(
        self,
        mode: Mode,
        last: int,
        tick: int,
        reset: Reset | None,
        estop: EStop | None,
        *,
        lowered: bool = False,
    ) -> str:
        """Why a robot is to begin to get up at this tick; "": it is not.

        It has been led down since the agent's last command, or because all of its commands came
        too late, which the plant alone knows; or the operator has released it.

        Args:
            mode: the agent's before this tick.
            last: tick of its last command, −1: it has given none.
            tick: the present one.
            reset: the operator's release, if it came; of what was in force when it was said.
            estop: an emergency stop, if one came: it outranks a release.
            lowered: whether the plant has just said that it has led the robot down.
        """
        if mode.passive:
            if reset is None or estop is not None or not self._rises or reset.tick < mode.since:
                return ""
            return with_detail(RESET, reset.by)[:REASON_MOST]
        away = tick > self._latest_ms if last < 0 else tick - last > self._away_ms
        if not (self._is_led_down and (away or lowered)):
            return ""
        return mode.reason if code_of(mode.reason) in COMMANDED else LED_DOWN

    def step(
        self,
        mode: Mode,
        rise: Rise | None,
        state: State,
        *,
        may_begin: bool,
        estop: EStop | None = None,
    ) -> RisingStep:
        """Get up by a tick.

        Args:
            mode: before it; of a robot that begins now, that it does and why.
            rise: what is remembered; None: the robot begins at this tick.
            state: what the robot measures.
            may_begin: whether the others stand, and the plant follows the commands: else the motion
                would have gone on without the robot, which would have to catch up with it at once.
            estop: an emergency stop, if one came.
        """
        tick = state.tick
        if rise is None:
            rise = Rise(state.q_joint)
        if estop is not None:
            mode = enter_passive(mode, tick, ESTOP, with_detail(ESTOP, estop.reason))
        elif trouble := self._find_trouble(rise, state):
            mode = enter_passive(mode, tick, DAMPING, trouble)
        if mode.passive:
            return RisingStep(mode, None, self._damp(tick))
        if rise.begun < 0 and may_begin:
            rise = Rise(rise.held, tick, way_up(state.q_joint, self._robot, _SECONDS))
        if self._has_settled(rise, tick) and self._is_up(state):
            mode, rise = Mode(STAND, tick, mode.reason), None
        return RisingStep(mode, rise, self._lead(rise, state))

    def _find_trouble(self, rise: Rise, state: State) -> str:
        """Why a robot cannot get up; "" if it can so far."""
        cosine = _upright(state)
        if math.isnan(cosine):
            return NO_ESTIMATE
        if cosine < self._fallen_cosine:
            return FALL
        late = rise.begun >= 0 and state.tick - rise.begun > _ms(rise.motion) + _LATEST_MS
        return NOT_UP if late else ""

    def _has_settled(self, rise: Rise, tick: int) -> bool:
        return rise.begun >= 0 and tick - rise.begun >= _ms(rise.motion) + _SETTLE_MS

    def _is_up(self, state: State) -> bool:
        """Whether the joints are at the stand, and the trunk is level."""
        off = np.abs(state.q_joint - self._robot.q_stand)
        return bool((off <= _OFF).all()) and _upright(state) >= _LEVEL

    def _lead(self, rise: Rise | None, state: State) -> Command:
        """The command that leads the joints where they ought to be at a tick.

        The motors follow it by themselves, so that a late one does no harm.
        """
        q_des, v_des = self._robot.q_stand, np.zeros(N_JOINTS)
        if rise is not None and rise.begun < 0:
            q_des = rise.held
        elif rise is not None:
            q_des, v_des = posture_at(rise.motion, 1e-3 * (state.tick - rise.begun))
        off = np.clip(q_des - state.q_joint, -self._most_off, self._most_off)
        kp, kd = np.full(N_JOINTS, self._kp), np.full(N_JOINTS, self._kd)
        zero = np.zeros(N_JOINTS)
        return Command(state.tick, state.stamp_ns, zero, state.q_joint + off, v_des, kp, kd)

    def _damp(self, tick: int) -> Command:
        row = np.zeros(60)
        row[Command.CUTS["kd"]] = self._damping
        return Command.from_row(tick, tick * 1_000_000, row)


def _upright(state: State) -> float:
    """Cosine of the trunk's tilt."""
    _, x, y, _ = state.imu_quat_wxyz
    return float(1.0 - 2.0 * (x * x + y * y))


def _ms(motion: Motion) -> int:
    return round(1e3 * motion.seconds)
