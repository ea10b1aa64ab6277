"""Sections of the low level: state estimator, gait, controller."""

from __future__ import annotations

from dataclasses import dataclass

from quadriga.shared.config.key import key


@dataclass(frozen=True, slots=True)
class EstimatorConfig:
    """The agent's Kalman filter on IMU and leg kinematics."""

    kind: str = key(
        "kalman",
        "-",
        "truth: the simulator's ground truth, for comparison only",
        choices=("kalman", "truth"),
    )
    accel_sigma: float = key(0.3, "m/s²", "process noise of the velocity", low=1e-4, high=100.0)
    foot_sigma: float = key(0.05, "m/s", "process noise of a stance foot", low=1e-5, high=10.0)
    swing_sigma: float = key(30.0, "m/s", "process noise of a swing foot", low=0.1, high=1e3)
    leg_position_sigma: float = key(1.5e-3, "m", "leg kinematics, position", low=1e-6, high=0.5)
    leg_velocity_sigma: float = key(0.1, "m/s", "leg kinematics, velocity", low=1e-5, high=10.0)
    trust_ramp: float = key(
        0.3, "1", "share of stance over which trust rises and falls", low=0.0, high=0.5
    )
    tilt_time: float = key(
        5.0,
        "s",
        "time constant with which the error of the IMU is found, of its roll, pitch and "
        "accelerometer, by the legs; 0: none is assumed",
        low=0.0,
        high=1e4,
    )
    trust_force: float = key(10.0, "N", "a foot with less load is not trusted", low=0.0, high=200.0)


@dataclass(frozen=True, slots=True)
class GaitConfig:
    """The trot."""

    stance_ms: int = key(200, "ms", "stance time, and swing time (duty 0.5)", low=50, high=1000)
    stand_ms: int = key(300, "ms", "stand on four legs before the first step", low=100, high=10000)


@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """The whole-body QP and the swing legs. The default is the robust setting."""

    preset: str = key(
        "robust",
        "-",
        "robust, soft (lets planned forces through) or plain (without what keeps a team up on "
        "uneven ground): replaces the defaults below",
        choices=("robust", "soft", "plain"),
    )
    gamma_tau: float = key(1e2, "1", "gamma_1, weight of torques", low=0.0, high=1e9)
    gamma_force: float = key(1e3, "1", "gamma_2, weight of force errors", low=0.0, high=1e9)
    gamma_defect: float = key(1e6, "1", "gamma_3, weight of the defect", low=1.0, high=1e12)
    tilt_length: float = key(
        0.15,
        "m",
        "weight of the trunk's angular defect against its linear one (paper: 1)",
        low=0.01,
        high=10.0,
    )
    swing_weight: float = key(
        0.3,
        "1",
        "weight of the swing feet's defect against the trunk's (paper: 1)",
        low=0.01,
        high=10.0,
    )
    mu: float = key(0.6, "1", "friction coefficient the QP may use", low=0.05, high=2.0)
    mu_min: float = key(
        0.35,
        "1",
        "least friction coefficient the QP uses, even while feet slide",
        low=0.05,
        high=2.0,
    )
    mu_slippery: float = key(
        0.12,
        "1",
        "likewise, where the forces of sliding feet show that there is less than mu_min",
        low=0.02,
        high=2.0,
    )
    mu_recovery: float = key(
        2.0,
        "1/s",
        "rate at which the friction coefficient recovers after feet slid; below mu_min a tenth",
        low=0.0,
        high=10.0,
    )
    slip_load: float = key(
        20.0, "N", "slip detection ignores a foot that bears less", low=0.0, high=200.0
    )
    slip_speed: float = key(
        0.3,
        "m/s",
        "a stance foot faster than this slides: the QP uses less friction; 0: never",
        low=0.0,
        high=5.0,
    )
    force_min: float = key(5.0, "N", "least normal force of a stance foot", low=0.0, high=50.0)
    kp_z: float = key(400.0, "1/s²", "height", low=0.0, high=1e4)
    kd_z: float = key(40.0, "1/s", "height rate", low=0.0, high=1e3)
    ki_z: float = key(400.0, "1/s³", "height integrator", low=0.0, high=1e5)
    kp_xy: float = key(0.0, "1/s²", "position, against the integrated speed", low=0.0, high=1e4)
    kd_xy: float = key(20.0, "1/s", "velocity", low=0.0, high=1e3)
    ki_xy: float = key(40.0, "1/s²", "velocity integrator", low=0.0, high=1e4)
    leak_xy: float = key(
        6.0,
        "s",
        "time constant of forgetting of the velocity integrator: yoked robots share one speed, so "
        "without it their estimators' biases would wind the integrators up against each other",
        low=0.01,
        high=1e6,
    )
    position_error_limit: float = key(
        0.05, "m", "limit of the position reference's lead", low=0.0, high=1.0
    )
    kp_tilt: float = key(1000.0, "1/s²", "roll and pitch", low=0.0, high=1e4)
    kd_tilt: float = key(60.0, "1/s", "roll and pitch rate", low=0.0, high=1e3)
    kp_yaw: float = key(100.0, "1/s²", "yaw", low=0.0, high=1e4)
    kd_yaw: float = key(20.0, "1/s", "yaw rate", low=0.0, high=1e3)
    kp_swing: float = key(400.0, "1/s²", "swing foot", low=0.0, high=1e4)
    kd_swing: float = key(40.0, "1/s", "swing foot rate", low=0.0, high=1e3)
    contact_detection: bool = key(True, "-", "early touchdown becomes stance, a lost foot descends")
    contact_force: float = key(
        4.0, "N", "load by a foot sensor that counts as contact", low=0.5, high=100.0
    )
    contact_torque_force: float = key(
        12.0, "N", "load by the joints' torques that counts as contact", low=0.5, high=200.0
    )
    reaction_filter_ms: float = key(
        3.0,
        "ms",
        "time constant of both filters of the load by the joints' torques",
        low=0.5,
        high=100.0,
    )
    calibration_time: float = key(
        3.0,
        "s",
        "how long foot sensors are compared with the joints' torques; what is older is forgotten",
        low=0.1,
        high=1e4,
    )
    lost_contact_ms: int = key(5, "ms", "stance without force until it descends", low=1, high=100)
    descent_speed: float = key(0.8, "m/s", "speed of a descending stance foot", low=0.0, high=3.0)
    reject_side_contacts: bool = key(
        True,
        "-",
        "a foot stopped from the side is no contact, nor one that landed early and bears no load",
    )
    reflex_ms: int = key(
        10,
        "ms",
        "a swing foot that is stopped rises until it has been free for this long; 0: no reflex",
        low=0,
        high=100,
    )
    reflex_lift: float = key(
        1.0, "m/s", "upward speed of a swing foot that was stopped", low=0.0, high=3.0
    )
    track_sinking_trunk: bool = key(
        True,
        "-",
        "a descending foot follows a sinking trunk; desired foot positions stay within the "
        "legs' reach",
    )
    flight: bool = key(True, "-", "without contact the desired motion of the trunk is free fall")
    load_time: float = key(
        1.0,
        "s",
        "time constant of the estimate of the external load; 0: no load is assumed",
        low=0.0,
        high=100.0,
    )
    swing_delay: float = key(
        0.0, "1", "share of swing in which a foot rises before it goes forward", low=0.0, high=0.5
    )
    swing_acceleration: float = key(
        100.0,
        "m/s²",
        "a swing that begins late has a foothold so near that it needs no more than this",
        low=1.0,
        high=1e4,
    )
    ground_filter_ms: float = key(50.0, "ms", "filter of the ground height", low=0.0, high=1e3)
    swing_height: float = key(
        0.09, "m", "apex above the highest foothold (paper: above the ground)", low=0.01, high=0.2
    )
    raibert_gain: float = key(0.03, "s", "foothold per velocity error", low=0.0, high=0.5)
    foothold_inwards: float = key(
        0.1,
        "m",
        "how far a foothold may lie from under where its hip is now towards the middle line; times "
        "1 + load / mass with an estimated load",
        low=0.0,
        high=10.0,
    )
    damping: float = key(
        2.0, "N·m·s/rad", "of joints in mode damping, and while QPs fail", low=0.1, high=10.0
    )
    fall_tilt: float = key(0.9, "rad", "a tilt beyond this is a fall: damping", low=0.3, high=1.5)
    max_failures: int = key(
        20,
        "ms",
        "failed QPs in a row before damping; until then the last torques, with that damping",
        low=1,
        high=1000,
    )
