"""A robot that was damped stands up where it is, once the operator has released it.

Its joints are held until no other robot of the team walks, then led to the stand, with limited
torques. Only once they are there, and the trunk is level, the robot stands.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from quadriga.agents.modes import requested_stops
from quadriga.agents.step_io import Inputs
from quadriga.plant.commands import damp_joints
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import BRIDGED, Config
from quadriga.shared.messages import Command, State
from quadriga.shared.modes import (
    FALL,
    NO_ESTIMATE,
    NOT_UP,
    PASSIVE,
    REASON_MOST,
    RESET,
    STAND,
    STANDING_UP,
    Mode,
    Stop,
    resolve_stops,
)
from quadriga.shared.robots.conventions import N_JOINTS, Array
from quadriga.shared.robots.motions import Motion, posture_at, way_up
from quadriga.shared.runtime.record import record

_SECONDS: Final = 1.5  # from lying on folded legs to the stand
_SETTLE_MS: Final = 200  # at the stand, before it is checked
_LATEST_MS: Final = 1500  # after the motion; then it does not stand
_SHARE: Final = 0.8  # of the motors' torque that stiffness may ask for
_OFF: Final = 0.25  # rad, that a joint may be off the stand
_LEVEL: Final = math.cos(0.45)  # of the greatest tilt, rad: a robot stands on a steep slope too


@record
class StandUp:
    """What an agent remembers while its robot stands up.

    Attributes:
        held: angles of the joints at the reset, (12,), rad.
        begun: tick at which the motion began; −1: it waits.
        motion: the way up, from the angles at that tick; None: it waits.
    """

    held: Array
    begun: int = -1
    motion: Motion | None = None


class StandUpRules:
    """Fixed data of how a robot stands up; what it gives depends on arguments alone."""

    def __init__(self, config: Config) -> None:
        self._by_bridge = config.team.plant == BRIDGED  # which gets its robot up by itself
        self._robot = config.robot
        self._kp, self._kd = config.bridge.stand_kp, config.bridge.stand_kd
        self._most_off = _SHARE * config.robot.torque_limit / self._kp  # (12,), rad
        self._fallen_cosine = math.cos(config.controller.fall_tilt)
        self._damping = config.controller.damping

    def begins(self, mode: Mode, inputs: Inputs) -> bool:
        """Whether the operator has released the robot; a stop at the same tick outranks that."""
        reset = inputs.reset
        if reset is None or inputs.estop is not None or self._by_bridge:
            return False
        return mode.passive and reset.tick >= mode.since

    def step(
        self, mode: Mode, stand_up: StandUp | None, inputs: Inputs, *, may_move: bool
    ) -> tuple[Mode, StandUp | None, Command]:
        """Stand up by a tick; with `stand_up` None the robot begins, it moves once others rest.

        Returns:
            The mode after it, what is to be remembered while the robot stands up, the command.
        """
        state, tick = inputs.state, inputs.state.tick
        if stand_up is None:
            by = "" if inputs.reset is None else inputs.reset.by
            mode = Mode(STANDING_UP, tick, with_detail(RESET, by)[:REASON_MOST])
            stand_up = StandUp(state.q_joint)
        stops, upright = requested_stops(inputs), _upright(state)
        if not upright >= self._fallen_cosine:
            stops.append(Stop(PASSIVE, NO_ESTIMATE if math.isnan(upright) else FALL))
        elif self._since_motion(stand_up, tick) > _LATEST_MS:
            stops.append(Stop(PASSIVE, NOT_UP))
        mode = resolve_stops(mode, tick, stops)
        if mode.passive:
            return mode, None, damp_joints(tick, self._damping)
        if stand_up.motion is None and may_move:
            stand_up = StandUp(stand_up.held, tick, way_up(state.q_joint, self._robot, _SECONDS))
        command = self._command(stand_up, state)
        settled = self._since_motion(stand_up, tick) >= _SETTLE_MS
        near = (np.abs(state.q_joint - self._robot.q_stand) <= _OFF).all()
        if settled and near and upright >= _LEVEL:
            return Mode(STAND, tick, mode.reason), None, command
        return mode, stand_up, command

    def _since_motion(self, stand_up: StandUp, tick: int) -> int:
        """For how long the motion has been over, ms; negative before."""
        if stand_up.motion is None:
            return -1
        return tick - stand_up.begun - round(1e3 * stand_up.motion.seconds)

    def _command(self, stand_up: StandUp, state: State) -> Command:
        """The command that leads the joints, which motors follow by themselves."""
        q_des, v_des = stand_up.held, np.zeros(N_JOINTS)
        if stand_up.motion is not None:
            q_des, v_des = posture_at(stand_up.motion, 1e-3 * (state.tick - stand_up.begun))
        q_des = state.q_joint + np.clip(q_des - state.q_joint, -self._most_off, self._most_off)
        kp, kd = np.full(N_JOINTS, self._kp), np.full(N_JOINTS, self._kd)
        return Command(state.tick, state.stamp_ns, np.zeros(N_JOINTS), q_des, v_des, kp, kd)


def _upright(state: State) -> float:
    """Cosine of the trunk's tilt."""
    _, x, y, _ = state.imu_quat_wxyz
    return float(1.0 - 2.0 * (x * x + y * y))
