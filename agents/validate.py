"""Which readings of a robot's sensors are valid, and what stands for those that are not.

A reading is invalid that is no number, that is beyond what the sensor can measure, that jumps
against its own rate, or, of an IMU, that stays the same to the last digit while its gyro turns, or
says that gravity points upwards. The last valid one, at rest, takes its place. After `HOLD_MS` it
counts as lost, and the robot stands, by its joints alone; yokes keep a robot level, and drag along
one that stands, so that a yoked one does without for longer. A reading is valid again once it has
agreed with itself for `AGREES_MS`, an encoder near to where it was valid last. An error that grows
slowly, and a reading that is merely late, agree with themselves and pass.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.estimator.kinematics import rotation_matrix
from quadriga.agents.estimator.rigid_body import foot_forces
from quadriga.agents.plausibility import is_orientation
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, State
from quadriga.shared.modes import ENCODER_LOST, IMU_LOST
from quadriga.shared.robots.conventions import (
    GRAVITY,
    JOINT_NAMES,
    N_JOINTS,
    N_LEGS,
    Array,
    neighbours,
)
from quadriga.shared.robots.spec import RobotSpec
from quadriga.shared.runtime.jit import compiled

HOLD_MS: Final = 20  # for which the last valid reading stands for invalid ones
HOLD_YOKED_MS: Final = 600  # likewise, of a robot that is yoked to others
AGREES_MS: Final = 5  # for which readings must agree once one did not

_PAUSE: Final = 0.05  # s between two readings, after which anything may have happened
_JUMP: Final = 0.1  # rad, of an angle or attitude against its rate, from one reading to the next
_RETURN: Final = 0.5  # rad, from the last valid angle, within which one is valid again
_FASTEST: Final = 20.0  # rad/s, of joints: where readings are missing, more may have happened
_BEYOND: Final = 0.3  # rad beyond an end stop; encoders have an error of their zero
_ACCEL_MAX: Final = 150.0  # m/s²: accelerometers of such robots end at 16 g
_UP_TIME: Final = 0.015  # s, time constant of the force that holds the trunk against gravity
_UP_LEAST: Final = -6.0  # m/s²; a trunk that is thrown over is pulled down by less
_TURNS: Final = 1e-3  # rad/s, of a gyro that says that the trunk moves
_SAME_MS: Final = 20.0  # for which an IMU may read the same: it may be slower than the ticks
_LEAD_MS: Final = 200.0  # from where the joints are to the stand: a swinging foot is soon down

_IMU: Final = N_JOINTS  # index of attitude and gyro behind the joints' encoders
_FORCE: Final = N_JOINTS + 1  # of the accelerometer, which alone no robot needs to walk
_N_SENSORS: Final = N_JOINTS + 2
_Q, _V = State.CUTS["q_joint"], State.CUTS["v_joint"]
_QUAT, _GYRO = State.CUTS["imu_quat_wxyz"], State.CUTS["imu_gyro"]
_ACCEL: Final = State.CUTS["imu_accel"]
_N_STATE: Final = State.SIZE


# What is remembered of the readings from one tick to the next, see `RobotState` of such rows.
READINGS: Final = np.dtype(
    (
        np.record,
        [
            ("read", float, _N_STATE),  # the last state, as it was read, `State.row`
            ("valid", float, _N_STATE),  # the last valid readings, likewise
            ("agrees", float, _N_SENSORS),  # for how long each has agreed with itself, ms
            ("missing", float, _N_SENSORS),  # for how long each has not been valid, ms
            ("same", float),  # for how long the IMU has read the same, ms
            ("up", float),  # specific force along the IMU's own vertical, filtered, m/s²
        ],
    )
)


class Validated(NamedTuple):
    """What is known of the sensors after a tick.

    Attributes:
        memory: for the next tick, a row of `READINGS`.
        state: what was read, with the last valid readings in place of invalid ones.
        imu: whether a reading of the IMU is invalid now.
        encoders: joints, of 0 … 11, whose encoder's reading is invalid now.
        lost: why the robot can walk no more; "": it can.
    """

    memory: Array
    state: State
    imu: bool
    encoders: tuple[int, ...]
    lost: str

    @property
    def complete(self) -> bool:
        """Whether all readings are valid."""
        return not (self.imu or self.encoders)


class Validator:
    """Fixed data of how readings of robot `index` (0-based) are checked, and how it stands without.

    Attributes:
        lower, upper: angles within which an encoder's reading can be, (12,), rad.
    """

    def __init__(self, config: Config, index: int) -> None:
        robot = config.robot
        yoked = neighbours(config.team.robots, config.team.yokes, index)
        self._hold_ms = HOLD_YOKED_MS if yoked else HOLD_MS
        self.lower = np.array(robot.lower) - _BEYOND
        self.upper = np.array(robot.upper) + _BEYOND
        self._stand, self._standing_torque = robot.q_stand, standing_torques(robot)
        self._kp, self._kd = config.bridge.stand_kp, config.bridge.stand_kd
        # Compiled, or loaded, now and not in the first tick.
        validate_rows(_first(np.zeros(_N_STATE)), np.zeros(_N_STATE), self.lower, self.upper, 1e-3)

    def step(self, memory: Array | None, state: State, dt: float) -> Validated:
        """Check the readings of a tick, `dt` s after the last one, which left `memory`."""
        row = _first(state.row) if memory is None else memory.copy()
        if validate_rows(row, state.row, self.lower, self.upper, dt):
            return Validated(row, state, imu=False, encoders=(), lost="")
        known = row.view(READINGS)[0]
        invalid = np.flatnonzero(known.missing > 0.0).tolist()
        encoders = tuple(joint for joint in invalid if joint < N_JOINTS)
        imu, stands_in = len(encoders) < len(invalid), state.row.copy()
        if imu:
            _replace_imu(stands_in, known.valid, known.missing[_IMU] > 0.0)
        for joint in encoders:
            stands_in[_Q][joint], stands_in[_V][joint] = known.valid[_Q][joint], 0.0
        valid = State.from_row(state.tick, state.stamp_ns, stands_in)
        lost = [joint for joint in encoders if known.missing[joint] > self._hold_ms]
        names = ",".join(JOINT_NAMES[joint].removesuffix("_joint") for joint in lost)
        reason = with_detail(ENCODER_LOST, names) if lost else ""
        if known.missing[_IMU] > self._hold_ms:
            reason = IMU_LOST
        return Validated(row, valid, imu, encoders, reason)

    def stand(self, since: Array | None, read: Validated) -> tuple[Array, Command]:
        """Stand without an attitude, or a joint's angle: the motors lead their joints to the stand.

        A motor without its angle cannot: it gives the torque that it has in the stand, and no
        damping, as its rate is no better known.

        Args:
            since: tick at which the robot began to stand so and its joints' angles then, (13,),
                rad; None: it begins.
            read: the readings of this tick.

        Returns:
            The new `since`, and the command.
        """
        state = read.state
        since = np.concatenate([[state.tick], state.q_joint]) if since is None else since
        share = min(1.0, (state.tick - since[0]) / _LEAD_MS)
        smooth = share * share * (3.0 - 2.0 * share)
        tau, lost = np.zeros(N_JOINTS), list(read.encoders)
        kp, kd = np.full(N_JOINTS, self._kp), np.full(N_JOINTS, self._kd)
        tau[lost], kp[lost], kd[lost] = self._standing_torque[lost], 0.0, 0.0
        q_des = since[1:] + smooth * (self._stand - since[1:])
        return since, Command(state.tick, state.stamp_ns, tau, q_des, np.zeros(N_JOINTS), kp, kd)


def standing_torques(robot: RobotSpec) -> Array:
    """Torques of the motors of a robot that stands on four feet, legs without mass, (12,), N·m."""
    weight = np.array([0.0, 0.0, GRAVITY * robot.geometry.mass / N_LEGS])
    units = np.tile(np.eye(3), N_LEGS)
    forces = [foot_forces(-unit, robot.q_stand, robot.geometry) for unit in units]
    torques: Array = np.linalg.solve(np.stack(forces, axis=-1), weight).ravel()
    return torques


def _first(state: Array) -> Array:
    """What is remembered before the first tick: nothing is doubted, the trunk is level."""
    row = np.zeros(READINGS.itemsize // 8)
    memory = row.view(READINGS)[0]
    memory.read = memory.valid = state
    memory.valid[_QUAT] = 1.0, 0.0, 0.0, 0.0
    memory.agrees, memory.up = AGREES_MS, GRAVITY
    return row


@compiled
def validate_rows(row: Array, state: Array, lower: Array, upper: Array, dt: float) -> bool:
    """Whether all readings of a tick are valid; `row`, of `READINGS`, is brought up to date."""
    memory, ms, whole = row.view(READINGS)[0], 1e3 * dt, True
    jump = _JUMP + _FASTEST * max(0.0, dt - 1e-3)
    for index in range(_N_SENSORS):
        if index == _IMU:
            sound = _is_sound_attitude(memory, state, dt)
        elif index == _FORCE:
            sound = 0.0 < np.max(np.abs(state[_ACCEL])) < _ACCEL_MAX
        else:
            q, v, last = state[_Q][index], state[_V][index], memory.read
            follows = abs(q - last[_Q][index] - 0.5 * dt * (v + last[_V][index])) <= jump
            near = memory.missing[index] == 0.0 or abs(q - memory.valid[_Q][index]) <= _RETURN
            possible = lower[index] <= q <= upper[index] and np.isfinite(v)
            sound = possible and (dt > _PAUSE or (follows and near))
        memory.agrees[index] = min(memory.agrees[index] + ms, 1e6) if sound else 0.0
        if memory.agrees[index] < AGREES_MS:
            memory.missing[index] += ms
            whole = False
            continue
        memory.missing[index] = 0.0
        if index == _IMU:
            memory.valid[_QUAT] = state[_QUAT]
        elif index < N_JOINTS:
            memory.valid[_Q][index] = state[_Q][index]
    memory.read[:] = state
    return whole


@compiled
def _is_sound_attitude(memory: np.record, state: Array, dt: float) -> bool:
    """Whether attitude and gyro can be, and follow from what they were before."""
    last, quat, gyro, accel = memory.read, state[_QUAT], state[_GYRO], state[_ACCEL]
    same = True
    for index in range(_QUAT.start, _ACCEL.stop):
        same = same and state[index] == last[index]
    memory.same = memory.same + 1e3 * dt if same else 0.0
    if memory.same >= _SAME_MS and np.max(np.abs(gyro)) > _TURNS:
        return False
    if not (np.isfinite(np.sum(gyro)) and is_orientation(quat)):
        return False
    if 0.0 < np.max(np.abs(accel)) < _ACCEL_MAX:
        memory.up += dt / (_UP_TIME + dt) * (np.sum(rotation_matrix(quat)[2] * accel) - memory.up)
    doubted = memory.missing[_IMU] > 0.0  # one that falls freely feels hardly anything
    if memory.up < (-_UP_LEAST if doubted else _UP_LEAST):
        return False
    if dt > _PAUSE or not is_orientation(last[_QUAT]):
        return dt > _PAUSE
    # Half the sine of the angle between what follows by the gyro and what is read.
    a, b, c = 0.25 * dt * (last[_GYRO] + gyro)
    w, x, y, z = last[_QUAT]
    turned = (-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c)
    expected = last[_QUAT] + np.array([*turned, w * c + x * b - y * a])
    norms = np.sqrt(np.sum(expected * expected) * np.sum(quat * quat))
    return bool(abs(np.sum(expected * quat)) >= np.cos(0.5 * _JUMP) * norms)


@compiled
def _replace_imu(row: Array, valid: Array, attitude: bool) -> None:
    """Let gravity alone act in a state, and put the last valid `attitude` into it, at rest."""
    if attitude:
        row[_QUAT] = valid[_QUAT] / np.sqrt(np.sum(valid[_QUAT] * valid[_QUAT]))
        row[_GYRO] = 0.0
    row[_ACCEL] = GRAVITY * rotation_matrix(row[_QUAT])[2]
