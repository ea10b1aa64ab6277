"""The two records of a control tick: what is known of a robot, and what it is controlled with.

A tick goes from one row of numbers to the next: compiled code takes a row for the price of one
array. `row.view(ROBOT_STATE)[0]` names its parts, `state.contact[leg]`, there and in plain Python.
In all compiled code `state` is a record of `ROBOT_STATE` and `gains` one of `GAINS`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any, ClassVar, Final

import numpy as np
import pinocchio as pin

from quadriga.agents.estimator.rigid_body import LINK_SIZE, N_LINKS, link_table
from quadriga.shared.config.sections import Config, ControllerConfig, EstimatorConfig
from quadriga.shared.robots.conventions import N_FORCES, N_JOINTS, N_LEGS, N_OUTPUTS, Array, Leg
from quadriga.shared.robots.pinocchio_model import build_pinocchio_model
from quadriga.shared.robots.spec import Geometry
from quadriga.shared.robots.torque_speed import motor_curves
from quadriga.shared.runtime.record import record

# What is known of a robot at a tick and remembered from one to the next. Legs FL FR RL RR; flags
# are 1 or 0; "odometry" is a frame with z up that drifts with the estimate.
ROBOT_STATE: Final = np.dtype(
    (
        np.record,
        [
            # The gait at this tick.
            ("dt", float),  # time since the last tick, s
            ("stance", float, N_LEGS),  # flag: scheduled to stand
            ("progress", float),  # of the half cycle, [0, 1)
            ("half_cycle", float),  # its number; −1: the robot stands on four feet
            ("switched", float),  # flag: stances and swings have just ended
            # What the sensors measure, in the order of `State`, the error of the IMU taken off.
            ("q_joint", float, N_JOINTS),  # rad
            ("v_joint", float, N_JOINTS),  # rad/s
            ("tau_joint", float, N_JOINTS),  # N·m
            ("quat_wxyz", float, 4),  # trunk to odometry, of any positive norm
            ("omega", float, 3),  # rad/s, trunk frame
            ("accel", float, 3),  # specific force, m/s², trunk frame
            ("foot_counts", float, N_LEGS),  # raw
            # The filter: trunk position, trunk velocity and feet; the axes share one covariance.
            ("filter_mean", float, (6, 3)),  # m, m/s, odometry
            ("covariance", float, (6, 6)),  # m², m²/s²
            ("imu_error", float, 3),  # of the acceleration that the IMU tells, m/s², trunk frame
            ("imu_error_age", float),  # for how long it has been estimated, s
            # Trunk and feet by the filter.
            ("position", float, 3),  # of the trunk's origin, m, odometry
            ("velocity", float, 3),  # likewise, m/s, odometry
            ("R", float, (3, 3)),  # trunk to odometry
            ("q", float, 19),  # Pinocchio's configuration
            ("v", float, 18),  # Pinocchio's velocity, the trunk's in the trunk's frame
            ("p_foot", float, (N_LEGS, 3)),  # centres of the feet, m, odometry
            ("v_foot", float, (N_LEGS, 3)),  # m/s, odometry
            ("outputs", float, N_OUTPUTS),  # the planner's y: z over the ground, vx, vy, …
            # What each foot bears, see `foot_load`.
            ("foot_force", float, N_LEGS),  # vertical, N
            ("foot_loaded", float, N_LEGS),  # flag: that is enough to be a contact
            ("ground_force", float, (N_LEGS, 3)),  # by the joints' torques, N, odometry
            ("load_ticks", float),  # steps since the filters of the torques began
            ("v_smooth", float, N_JOINTS),  # filtered joint rates, rad/s
            ("torque", float, N_JOINTS),  # reaction torques, filtered once, N·m
            ("torque_smooth", float, N_JOINTS),  # and twice
            ("counts", float, N_LEGS),  # of the foot sensors, filtered once
            ("counts_smooth", float, N_LEGS),  # and twice
            ("compared", float, N_LEGS),  # time for which sensor and torques were compared, s
            ("mean_force", float, N_LEGS),  # of the comparison, N
            ("mean_counts", float, N_LEGS),
            ("var_force", float, N_LEGS),
            ("var_counts", float, N_LEGS),
            ("cov_counts", float, N_LEGS),  # of force and counts
            ("last_counts", float, N_LEGS),
            ("nearest", float, N_LEGS),  # of sensor and torques since the counts changed, N
            ("differs", float, N_LEGS),  # time for which a sensor has differed from torques, s
            ("loaded_by_torque", float, N_LEGS),  # flag
            # Contacts, see `contact`.
            ("contact", float, N_LEGS),  # flag: the QP may push
            ("early_contact", float, N_LEGS),  # flag: it landed before its stance began
            ("unloaded", float, N_LEGS),  # time without force during stance, s
            ("touchdown_seen", float, N_LEGS),  # flag: it has borne load in this stance
            ("ground", float, N_LEGS),  # height last measured under each foot, m, odometry
            ("ground_height", float),  # filtered, under the stance feet, m, odometry
            ("lift", float, N_LEGS),  # progress at which each swing began
            ("retraction", float, N_LEGS),  # time for which it will still back off, s
            ("reaction", float, (N_LEGS, 3)),  # what stops a foot in the air, m/s², odometry
            # Load and friction, see `payload_friction`.
            ("payload", float),  # kg
            ("mu_reduction", float),  # taken off the friction coefficient as feet slid
            # The controller.
            ("swing_start", float, (N_LEGS, 3)),  # where each foot left the ground, m, odometry
            ("foot_goal", float, (N_LEGS, 3)),  # where one without ground is lowered to, m
            ("height_integral", float),  # of the height error, m·s
            ("speed_integral", float, 2),  # leaking integral of the speed error, m, yaw frame
            ("position_error", float, 2),  # limited integral of it, m, yaw frame
            ("yaw_des", float),  # rad
            ("v_des", float, 2),  # of the trunk, m/s, odometry
            ("stood_s", float),  # for how long all feet have stood, as they are meant to, s
            ("heading_over_feet", float),  # desired heading less that of the feet, rad
            ("force_sum", float, N_FORCES),  # of the planned forces in this sample, N, yaw frame
            ("force_count", float),  # ticks of it
            # What the whole-body QP is asked for, odometry.
            ("acc_des", float, 6),  # of the trunk, linear and angular, m/s², rad/s²
            ("swing_acc_des", float, (N_LEGS, 3)),  # of the feet not in contact, m/s²
            ("force_des", float, (N_LEGS, 3)),  # contact forces, N
        ],
    )
)

# The numbers of the sections `controller` and `estimator` under their keys, units there, and those
# of the robot: `Geometry`, and
GAINS: Final = np.dtype(
    (
        np.record,
        [
            (key.name, float)
            for section in (ControllerConfig, EstimatorConfig)
            for key in fields(section)
            if key.type != "str"
        ]
        + [(name, float) for name in Geometry._fields]
        + [
            ("stance_time", float),  # duration of the half cycle, s
            ("imu", float, 3),  # where the accelerometer is, m, trunk frame
            ("under_hip", float, 2),  # where a foot stands at rest, forwards and outwards, m
            ("reach", float),  # how far under the hip a foot is lowered, m
            ("stand_height", float),  # of the trunk's origin, m
            ("weight", float),  # of the bare robot, N; nominal forces carry it
            ("links", float, (N_LINKS, LINK_SIZE)),  # `link_table` of the bare robot
            ("body_mass", float),  # of the bare robot, kg
            ("com", float, 3),  # its centre of mass in the nominal pose, m, trunk frame
            ("inertia_inverse", float, (3, 3)),  # about that, 1/(kg·m²), trunk frame
            ("motors", float, (4, N_JOINTS)),  # rows of `MotorCurves`
        ],
    )
)


def gains_row(config: Config) -> Array:
    """The row of `GAINS` that a configuration and its robot set."""
    robot, row = config.robot, np.zeros(GAINS.itemsize // 8)
    gains = row.view(GAINS)[0]
    known = asdict(config.controller) | asdict(config.estimator) | robot.geometry._asdict()
    for name in known.keys() & set(GAINS.names or ()):
        gains[name] = known[name]
    gains.stance_time = 1e-3 * config.gait.stance_ms
    gains.imu, gains.under_hip = robot.imu, robot.feet_under_hips[Leg.FL]
    gains.reach, gains.weight, gains.stand_height = robot.reach, robot.weight, robot.stand_height
    gains.motors = np.array(motor_curves(robot, torque_speed=config.motors.torque_speed))

    model = build_pinocchio_model(robot, rotors=config.motors.rotor_inertia)
    q, data = pin.neutral(model), model.createData()
    q[7:] = robot.q_stand
    pin.ccrba(model, data, q, np.zeros(model.nv))
    gains.links, gains.body_mass = link_table(model), pin.computeTotalMass(model)
    gains.com = pin.centerOfMass(model, data, q)
    gains.inertia_inverse = np.linalg.inv(data.Ig.inertia)
    return row


Cuts = Mapping[str, tuple[slice, tuple[int, ...]]]


def cuts_of_record(kind: np.dtype[Any]) -> Cuts:
    """Where a row of float64 has the fields of a record, and their shapes."""
    return {
        name: (slice(offset // 8, (offset + part.itemsize) // 8), part.shape)
        for name, (part, offset, *_) in (kind.fields or {}).items()
    }


@record
class RecordRow:
    """A row of numbers, not to be changed, with the fields of a record for attributes.

    Attributes:
        row: all numbers.
    """

    CUTS: ClassVar[Cuts] = {}
    row: Array

    def __getattr__(self, name: str) -> Any:
        """A field of the record: a view, or a number."""
        try:
            cut, shape = self.CUTS[name]
        except KeyError:
            raise AttributeError(name) from None
        return self.row[cut].reshape(shape) if shape else float(self.row[cut.start])


@record
class RobotState(RecordRow):
    """A robot at one tick; its attributes are the fields of `ROBOT_STATE`."""

    CUTS = cuts_of_record(ROBOT_STATE)

    @property
    def upright(self) -> float:
        """Cosine of the angle between the trunk's z axis and the vertical."""
        return float(self.R[2, 2])
