"""The whole configuration: one dataclass a section; each key has a default, a unit and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from math import inf
from typing import Any, Final

from quadriga.shared.config.terrains import TERRAINS, terrain_meanings
from quadriga.shared.errors import ConfigError
from quadriga.shared.planner_kinds import BUILT_IN, find_kind, read_options
from quadriga.shared.robots.registry import ROBOTS
from quadriga.shared.robots.spec import RobotSpec

SIMULATED: Final = "mujoco"  # the kind of plant that is a simulated world
BRIDGED: Final = "robots"  # the kind that is robots of their own, each behind a bridge
CONFIGURED: Final = "configured"  # the operator asks for what [reference] says
BY_HAND: Final = "hand"  # for what a person asks
Numbers = tuple[float, ...]


def number(default: Any, unit: str, low: float, high: float, doc: str) -> Any:
    """A key that is a number within limits, or as many of them as its default has.

    The default also says the type of all values; the unit is "-" or "1" of what has none.
    """
    return key(default, doc, unit=unit, low=low, high=high)


def choice(choices: tuple[str, ...], doc: str, more: str = "") -> Any:
    """A key that is one of some words, the first by default.

    With `more`, which says what else there may be, the check of the whole configuration decides.
    """
    return key(choices[0], doc, choices=choices, more=more)


def key(default: Any, doc: str, **meta: Any) -> Any:
    """A key that is any text of one line, or true or false, as its default is."""
    usual = {"unit": "-", "low": -inf, "high": inf, "choices": (), "more": ""}
    return field(default=default, metadata={"doc": doc, **usual, **meta})


@dataclass(frozen=True, slots=True)
class TeamConfig:
    """The robots of the team."""

    name: str = key("team", "first part of every key; teams on one network need own names")
    robots: int = number(3, "1", 1, 10, "number of robots r1 … rn")
    robot: str = choice(tuple(ROBOTS), "kind of all robots of the team")
    yokes: str = choice(("complete", "chain", "ring", "none"), "which pairs are yoked")
    spacing: float = number(0.9, "m", 0.6, 3.0, "distance between neighbours at the start")
    alternate_phase: bool = key(True, "every second robot trots half a gait period later")
    auto_resume: bool = key(
        False,
        "robots that stand because an input was lost walk again once all have been whole for "
        "resume_after; false: only once the operator says so (quadriga resume)",
    )
    # More would outlast the operator's request, which is obeyed for 5 s.
    resume_after: float = number(
        1.0, "s", 0.2, 4.0, "how long all inputs must have been whole before a robot walks again"
    )
    plant: str = key(SIMULATED, "mujoco; robots: real ones behind bridges; or a plug-in's kind")
    plant_per_robot: bool = key(False, "every robot has a plant of its own; false: one for all")
    agent_command: str = key(
        "",
        "command line of a program of one's own that is the agent of each robot, see "
        "docs/tutorials/own_controller.md; empty: the project's own agents",
    )

    @property
    def one_world(self) -> bool:
        """Whether the plant is one simulated world of all robots: it knows the truth of all."""
        return self.plant == SIMULATED and not self.plant_per_robot


@dataclass(frozen=True, slots=True)
class BusConfig:
    """How the processes reach each other over Zenoh."""

    mode: str = choice(("peer", "client"), "peer: processes connect directly; client: by a router")
    endpoint: str = key(
        "tcp/127.0.0.1:7447",
        "where the sim server, or plant_r1, listens (peer) or the router is (client); off the "
        "loopback tls/HOST:PORT",
    )
    listen: str = key("tcp/127.0.0.1:0", "peer: where all others listen; port 0: any free one")
    certificates: str = key(
        "certs", "tls/HOST:PORT: folder with a folder for each process, see docs/security.md"
    )
    plaintext: bool = key(
        False, "permit others than tls off the loopback: whoever reaches them commands the robots"
    )
    barrier_timeout: float = number(60.0, "s", 0.1, 3600.0, "how long to wait for all processes")
    clock_timeout: float = number(
        0.5, "s", 0.3, 10.0, "realtime: age of a plant's newest message at which the walk ends"
    )


@dataclass(frozen=True, slots=True)
class PlantConfig:
    """How a plant and the agents of its robots reach each other."""

    link: str = choice(
        ("auto", "local", "bus"),
        "states and commands; local: sockets of one computer and user; bus: keys of the bus; auto: "
        "local where both ends are on one computer, which they are on the loopback",
    )


@dataclass(frozen=True, slots=True)
class WorldConfig:
    """The simulated world and its seeded disturbances."""

    mode: str = choice(("lockstep", "realtime"), "lockstep waits for all commands")
    seed: int = number(0, "-", 0, 2**31, "seed of terrain, noise and everything else random")
    duration: float = number(20.0, "s", 0.5, 3600.0, "world time to walk")
    scenario: str = key("", "name of the scenario these keys come from: a label only")
    initial_posture: str = choice(
        ("standing", "lying"), "how simulated robots begin; lying: on their feet with folded legs"
    )
    scatter: float = number(0.0, "m", 0.0, 0.1, "how far off its place a robot may start, seeded")
    terrain: str = choice(tuple(TERRAINS), f"kind of ground; {terrain_meanings()}")
    terrain_height: float = number(
        0.05, "m", 0.0, 0.3, "greatest height; of pebbles that of the largest, at least 0.005"
    )
    slope: float = number(8.0, "deg", 0.5, 25.0, "terrain slope: grade of the ramps")
    stairs_rise: float = number(0.06, "m", 0.0, 0.2, "terrain stairs: height of a step")
    stairs_run: float = number(0.3, "m", 0.1, 2.0, "terrain stairs: depth of a tread")
    stairs_count: int = number(8, "1", 1, 50, "terrain stairs: steps up, and down again")
    friction: float = number(0.8, "1", 0.05, 2.0, "friction coefficient of feet on ground")
    friction_of: str = key("", "robots whose feet find another friction: 'r2:0.3,r3:0.5'")
    leg_collisions: bool = key(
        True, "all links collide with ground and each other; false: only feet and trunks do"
    )
    payload: float = number(0.0, "kg", 0.0, 60.0, "load unknown to the agents")
    payload_on: str = key(
        "team", "who carries it: 'team' in equal shares, names 'r1,r2', or with shares 'r1:6,r3:4'"
    )
    payload_scatter: float = number(
        0.0, "m", 0.0, 0.15, "how far a load may lie off the trunk's centre along x and y, seeded"
    )
    push: str = key(
        "",
        "pushes 'robot:force[N]:direction[deg]:start[s]:duration[s]' separated by commas; "
        "robot may be 'all'; direction 0 is forward, 90 is left",
    )
    push_force: float = number(0.0, "N", 0.0, 5000.0, "seeded series of pushes in turn; 0: none")
    push_spread: float = number(0.0, "1", 0.0, 1.0, "spread of push_force, seeded")
    push_every: float = number(3.0, "s", 0.1, 600.0, "time between two pushes, before the first")
    push_duration: float = number(0.2, "s", 1e-3, 10.0, "duration of each push of the series")
    motor_strength: str = key(
        "",
        "motors that weaken: 'robot:joint:start[s]:share' separated by commas; joint as FL_calf, "
        "calf or FL, either may be 'any', and what is left open is drawn from the seed; share of "
        "its torque that the motor still gives, 0.6 where none is said",
    )
    faults: str = key(
        "",
        "faulty sensors and motors, 'robot/component kind start[s] [duration[s]]' separated by "
        "commas, as 'r2/imu stuck 4 2'; docs/world.md has the components and kinds",
    )
    live_faults: bool = key(False, "quadriga fault --live may make sensors and motors faulty")
    command_timeout: float = number(
        10.0, "s wall", 0.05, 60.0, "lockstep: a robot that is silent longer ends the walk"
    )
    command_hold_ms: int = number(20, "ms", 1, 1000, "realtime: an older command is held")
    command_damp_ms: int = number(200, "ms", 1, 10000, "realtime: an older command ends the walk")

    @property
    def uneven(self) -> bool:
        """Whether the ground is anything but a plane."""
        kind = TERRAINS[self.terrain]
        return bool(kind.builder) and getattr(self, kind.height_key) > 0.0

    @property
    def ground(self) -> str:
        """What the ground is, in words."""
        return TERRAINS[self.terrain].text.format_map(asdict(self))


@dataclass(frozen=True, slots=True)
class SensorsConfig:
    """Noise and errors of the simulated sensors (standard deviations, where nothing else is said).

    What is drawn once is drawn for each robot, joint and foot from the world's seed. The defaults
    of accelerometer and feet are the A1's; other robots' records (`shared/robots`) have their own.
    """

    preset: str = choice(("realistic", "ideal"), "ideal: noise and biases of the IMU alone, feet N")
    joint_position: float = number(5e-4, "rad", 0.0, 0.1, "encoder noise")
    joint_offset: float = number(0.01, "rad", 0.0, 0.2, "error of each encoder's zero, drawn once")
    joint_velocity: float = number(0.05, "rad/s", 0.0, 5.0, "encoder rate noise")
    joint_torque: float = number(0.1, "N·m", 0.0, 10.0, "torque noise")
    gyro: float = number(0.01, "rad/s", 0.0, 1.0, "gyro noise")
    gyro_bias: float = number(0.002, "rad/s", 0.0, 1.0, "gyro bias, drawn once per run")
    accel: float = number(0.1, "m/s²", 0.0, 10.0, "accelerometer noise")
    accel_bias: float = number(0.15, "m/s²", 0.0, 5.0, "accelerometer bias, drawn once")
    orientation: float = number(1e-3, "rad", 0.0, 0.2, "IMU attitude noise")
    orientation_bias: float = number(0.01, "rad", 0.0, 0.2, "IMU roll and pitch error, drawn once")
    yaw_drift: float = number(0.002, "rad/s", 0.0, 0.1, "drift of the IMU's yaw, drawn once")
    foot_sensor: str = choice(
        ("counts", "newtons", "none"),
        "what feet measure. counts: raw units with scale, offset, drift and dropouts, held and "
        "rounded to 16 bits; newtons: N, with noise, never negative; none: always 0",
    )
    foot_force: float = number(0.05, "N", 0.0, 50.0, "foot force noise")
    foot_scale: float = number(12.5, "1/N", 0.01, 50.0, "counts per N, the median of all feet")
    foot_scale_spread: float = number(0.06, "1", 0.0, 2.0, "of the logarithm of that, drawn once")
    foot_offset: float = number(120.0, "1", -1e4, 1e4, "counts of an unloaded foot, mean of all")
    foot_bias: float = number(30.0, "1", 0.0, 1e4, "how far each foot's differ from that, once")
    foot_drift: float = number(1.5, "1/√s", 0.0, 1e3, "random walk of that, counts after 1 s")
    foot_refresh_rate: float = number(49.0, "Hz", 1.0, 1e3, "of counts; in between they are held")
    foot_dropout_rate: float = number(
        0.05, "1/s", 0.0, 100.0, "how often a foot's sensor fails: it reads 0, or its last value"
    )
    foot_dropout_ms: float = number(200.0, "ms", 1.0, 6e4, "how long a failure lasts on average")


@dataclass(frozen=True, slots=True)
class MotorsConfig:
    """Motors and joints: what the world simulates, and what of it the low level's model has."""

    preset: str = choice(("realistic", "ideal"), "ideal: no friction, inertia, delay, heat")
    torque_speed: bool = key(True, "torque falls with the joint's speed, to zero at its limit")
    friction: float = number(0.4, "N·m", 0.0, 0.8, "dry friction; it needs rotor_inertia = true")
    viscous_friction: float = number(0.04, "N·m·s/rad", 0.0, 1.0, "viscous friction of the joints")
    rotor_inertia: bool = key(True, "the rotors' inertia, as joints feel it behind the gears")
    bandwidth: float = number(100.0, "Hz", 0.0, 1e4, "corner of a motor's first-order lag; 0: none")
    delay_ms: int = number(2, "ms", 0, 50, "time from a command until the motors act on it")
    hard_stops: bool = key(True, "end stops give way by hardly anything; false: by hundredths")
    heat_time: float = number(300.0, "s", 0.0, 1e5, "thermal time constant of motors; 0: no heat")


@dataclass(frozen=True, slots=True)
class EstimatorConfig:
    """The agent's Kalman filter on IMU and leg kinematics."""

    kind: str = choice(("kalman", "truth"), "truth: the simulator's, for comparison only")
    tilt_time: float = number(
        5.0, "s", 0.0, 1e4, "time constant of finding the IMU's tilt and bias by the legs; 0: never"
    )


@dataclass(frozen=True, slots=True)
class GaitConfig:
    """The trot."""

    stance_ms: int = number(200, "ms", 50, 1000, "stance time, and swing time (duty 0.5)")
    stand_ms: int = number(300, "ms", 100, 10000, "stand on four legs before the first step")


@dataclass(frozen=True, slots=True)
class ControllerConfig:
    """The whole-body QP and the swing legs. The default is the robust setting."""

    preset: str = choice(
        ("robust", "soft", "plain"),
        "soft: lets planned forces through; plain: without what keeps a team up on rough ground",
    )
    gamma_tau: float = number(1e2, "1", 0.0, 1e9, "gamma_1, weight of torques")
    gamma_force: float = number(1e3, "1", 0.0, 1e9, "gamma_2, weight of force errors")
    gamma_defect: float = number(1e6, "1", 1.0, 1e12, "gamma_3, weight of the defect")
    tilt_length: float = number(0.15, "m", 0.01, 10.0, "angular against linear defect (paper: 1)")
    swing_weight: float = number(0.3, "1", 0.01, 10.0, "swing feet's against trunk's (paper: 1)")
    mu: float = number(0.6, "1", 0.05, 2.0, "friction coefficient the QP may use")
    slip_speed: float = number(0.3, "m/s", 0.0, 5.0, "a faster stance foot slides; 0: never")
    force_min: float = number(5.0, "N", 0.0, 50.0, "least normal force of a stance foot")
    kp_z: float = number(400.0, "1/s²", 0.0, 1e4, "height")
    kd_z: float = number(40.0, "1/s", 0.0, 1e3, "height rate")
    ki_z: float = number(400.0, "1/s³", 0.0, 1e5, "height integrator")
    kp_xy: float = number(0.0, "1/s²", 0.0, 1e4, "position, against the integrated speed")
    kd_xy: float = number(20.0, "1/s", 0.0, 1e3, "velocity")
    ki_xy: float = number(40.0, "1/s²", 0.0, 1e4, "velocity integrator")
    kp_tilt: float = number(1000.0, "1/s²", 0.0, 1e4, "roll and pitch")
    kd_tilt: float = number(60.0, "1/s", 0.0, 1e3, "roll and pitch rate")
    kp_yaw: float = number(100.0, "1/s²", 0.0, 1e4, "yaw")
    kd_yaw: float = number(20.0, "1/s", 0.0, 1e3, "yaw rate")
    kp_swing: float = number(400.0, "1/s²", 0.0, 1e4, "swing foot")
    kd_swing: float = number(40.0, "1/s", 0.0, 1e3, "swing foot rate")
    contact_detection: bool = key(True, "early touchdown becomes stance, a lost foot descends")
    contact_force: float = number(4.0, "N", 0.5, 100.0, "load by a foot sensor that is contact")
    calibration_time: float = number(3.0, "s", 0.1, 1e4, "time constant of foot sensors' fit")
    descent_speed: float = number(0.8, "m/s", 0.0, 3.0, "speed of a descending stance foot")
    reject_side_contacts: bool = key(
        True, "a foot stopped from the side is no contact, nor an early one that bears no load"
    )
    reflex_ms: int = number(10, "ms", 0, 100, "a stopped swing foot rises until free for this")
    track_sinking_trunk: bool = key(
        True, "a descending foot follows a sinking trunk; desired feet stay within reach"
    )
    flight: bool = key(True, "without contact the desired motion of the trunk is free fall")
    load_time: float = number(1.0, "s", 0.0, 100.0, "time constant of the external load; 0: none")
    swing_delay: float = number(0.0, "1", 0.0, 0.5, "share of swing in which a foot only rises")
    swing_height: float = number(0.09, "m", 0.01, 0.2, "apex above the higher foothold")
    raibert_gain: float = number(0.03, "s", 0.0, 0.5, "foothold per velocity error")
    foothold_inwards: float = number(
        0.1, "m", 0.0, 10.0, "how far inwards of its hip a foothold may lie; times 1 + load / mass"
    )
    damping: float = number(2.0, "N·m·s/rad", 0.1, 10.0, "in mode damping, or while QPs fail")
    fall_tilt: float = number(0.9, "rad", 0.3, 1.5, "a tilt beyond this is a fall: damping")
    max_failures: int = number(20, "ms", 1, 1000, "failed QPs in a row before damping")


@dataclass(frozen=True, slots=True)
class PlannerConfig:
    """The data-driven predictive planner."""

    preset: str = choice(
        ("usual", "fast", "paper"),
        "usual: plans every 40 ms; fast: every 10 ms, for a network that is faster than that; "
        "paper: as the paper writes it, with its Q and R",
    )
    kind: str = choice(
        tuple(BUILT_IN),
        "; ".join(f"{kind.name}: {kind.title}" for kind in BUILT_IN.values()),
        more="the name of a plug-in's",
    )
    options: str = key("", "numbers of a plug-in's planner: name=number, with spaces between")
    cost: str = choice(
        ("own", "team"),
        "distributed: what each agent minimises over its own forces. own: its own cost (eq. 12); "
        "team: that of the whole team, with the new plan mixed with its last one: plans approach "
        "a central planner's whatever the coupling",
    )
    compensation: bool = key(True, "distributed: bring peers' plans forward by their age")
    damping: float = number(
        -1.0,
        "1",
        -1.0,
        0.95,
        "share of an agent's own last plan that its new one keeps. -1: none with up to three "
        "robots (two with another preset than usual), else (n - 2)/(n + 2) with n; with the cost "
        "'team' 0 and -1 are the share with which the plans converge fastest",
    )
    exchanges: int = number(0, "-", 0, 8, "distributed: best responses to plans of the same step")
    latency_ms: int = number(8, "ms", 0, 100, "until a plan takes effect, ≤ 10·(N − applied)")
    lambda_g: float = number(1e5, "1", 1e-9, 1e12, "deepc: weight of ‖g‖²")
    lambda_sigma: float = number(1e5, "1", 1e-9, 1e15, "deepc: weight of ‖σ‖²")
    interface: str = choice(
        ("feedforward", "force"),
        "feedforward: force deviations become accelerations of the pre-stabilised trunk; "
        "force: planned forces and speeds are tracked by the whole-body QP (the paper)",
    )
    tracked: str = choice(
        ("speeds", "outputs"),
        "interface force: what the QP tracks of a plan. speeds: vx, vy; outputs: all (the paper)",
    )
    N: int = number(25, "samples", 4, 100, "control horizon")
    T_ini: int = number(10, "samples", 2, 50, "estimation horizon")
    applied: int = number(4, "samples", 1, 20, "samples applied before the next plan")
    Q: Numbers = number(
        (1e6, 1e5, 1e5, 2e5, 2e5, 2e3), "-", 0.0, inf, "weights of z, vx, vy, roll, pitch, wz"
    )
    R: Numbers = number((0.2, 0.2, 0.05), "-", 1e-9, inf, "weights of fx, fy, fz")
    mu: float = number(0.6, "1", 0.05, 2.0, "friction coefficient of the planned forces")
    force_min: float = number(0.0, "N", 0.0, 50.0, "least planned normal force")
    deviation_max: Numbers = number(
        (20.0, 20.0, 60.0), "N", 0.0, inf, "largest planned deviation from the nominal force"
    )
    output_bounds: str = choice(("none", "hard"), "planned outputs are bounded by output_max")
    output_max: Numbers = number(
        (0.03, 0.4, 0.3, 0.15, 0.15, 0.8),
        "m, m/s, m/s, rad, rad, rad/s",
        1e-6,
        inf,
        "largest planned deviation of z, vx, vy, roll, pitch, wz from what is commanded",
    )
    trust_range: Numbers = number(
        (0.06, 0.5, 0.25, 2.0), "m, m/s, rad, rad/s", 1e-6, inf, "beyond it the plan fades out"
    )
    solver: str = choice(
        ("daqp", "osqp"), "daqp: the closed form, Newton's method at limits of forces, else DAQP"
    )
    max_peer_age: int = number(3, "planning steps", 1, 25, "an older plan of a peer is not shifted")
    hold_steps: int = number(5, "planning steps", 0, 250, "how long a lost peer's terms are held")

    @property
    def option_values(self) -> Mapping[str, float]:
        """What `options` sets, and the defaults of its kind for the rest, in the kind's order."""
        return read_options(find_kind(self.kind), self.options)


@dataclass(frozen=True, slots=True)
class IdentificationConfig:
    """Data collection and the predictor's fit and gates."""

    preset: str = choice(("usual", "paper"), "paper: the pseudo-inverse, whatever its radius")
    seconds: float = number(0.0, "s", 0.0, 3600.0, "of training data; 0: by the size of the team")
    disturbed: float = number(0.25, "1", 0.0, 10.0, "share of this more, on boxes, under pushes")
    held_out: float = number(8.0, "s", 2.0, 600.0, "world time held out of the fit")
    episode: float = number(10.5, "s", 3.0, 600.0, "length of one episode")
    noise: Numbers = number((3.0, 3.0, 5.0), "N", 0.0, inf, "std of forces, each foot for itself")
    wrench_noise: Numbers = number(
        (16.0, 16.0, 8.0, 14.0, 8.0),
        "N",
        0.0,
        inf,
        "force noise of a robot's feet together, of either sign, at each stance foot: along x, y, "
        "z, vertical couple, horizontal couple",
    )
    vx: Numbers = number((-0.2, 0.7), "m/s", -2.0, inf, "range of random forward speeds")
    vy: Numbers = number((-0.2, 0.2), "m/s", -2.0, inf, "range of random sideways speeds")
    wz: Numbers = number((-0.3, 0.3), "rad/s", -2.0, inf, "range of random yaw rates")
    hold: float = number(1.5, "s", 0.1, 60.0, "how long a random speed is held")
    seed: int = number(1000, "-", 0, 2**31, "seed of the collection")
    predictor: str = choice(
        ("periodic", "ridge", "pinv"),
        "the fit of G. periodic: a function of the gait's phase, in which no force acts on outputs "
        "before it, with peers' forces by their net wrench; ridge: regularised, block-weighted; "
        "pinv: the paper's",
    )
    response: str = key(
        "",
        "predictor 'periodic': file responses.npz of a probe, instead of data: only in simulation; "
        "{robots} in it is how many there are",
    )
    neighbours: str = choice(
        ("all", "yoked"), "yoked: robots that are not yoked to each other are taken as uncoupled"
    )
    ridge: float = number(1e-3, "1", 1e-12, 1e3, "ridge per data column")
    block_weight: float = number(160.0, "1", 1.0, 1e4, "penalty weight w (as w²) of peers' columns")
    order_per_robot: int = number(12, "states", 1, 100, "system order n = this · robots")
    max_radius: float = number(1.0, "1", 0.01, 10.0, "gate: radius of the best-response map")
    max_peers_harm: float = number(
        0.02, "1", 0.0, 1000.0, "gate: share by which peers may raise an output's squared error"
    )
    gain_range: Numbers = number(
        (0.3, 2.0), "1", -10.0, inf, "gate: height gain, predicted / physical"
    )


@dataclass(frozen=True, slots=True)
class ReferenceConfig:
    """The reference of the operator once the team walks."""

    vx: float = number(0.5, "m/s", -1.0, 1.2, "forward speed")
    vy: float = number(0.0, "m/s", -0.5, 0.5, "leftward speed")
    wz: float = number(0.0, "rad/s", -1.0, 1.0, "yaw rate")
    height: float = number(0.26, "m", 0.2, 0.32, "trunk height above the ground")
    ramp: float = number(1.0, "s", 0.0, 20.0, "time from standing to full speed")
    trace: str = key(
        "",
        "CSV with columns t [s], vx, vy, wz that replaces these three, over and over: a path with "
        "a '/', or a file beside the scenarios; its lines are stored here, separated by ';'",
    )
    driver: str = choice(
        (CONFIGURED, BY_HAND),
        "who asks. configured: these keys; hand: whoever takes the controls, until then the team "
        "stands, see docs/driving.md",
    )
    page_port: int = number(0, "-", 0, 65535, "hand: port of the page to drive from; 0: any free")
    trace_shift: float = number(0.0, "s", 0.0, 3600.0, "the trace begins within this, seeded")


@dataclass(frozen=True, slots=True)
class RecorderConfig:
    """The recording of all traffic."""

    enabled: bool = key(True, "the team waits for the recorder before it walks")


@dataclass(frozen=True, slots=True)
class RuntimeConfig:
    """How the operating system runs the processes."""

    priority: str = choice(
        ("realtime", "ordinary"),
        "realtime: agents, planner and plants, in lockstep also the recorder, take precedence over "
        "ordinary processes (SCHED_RR) if the user may do so; in realtime the recorder has nice "
        "-15, and takes the same precedence once it gets too little; QUADRIGA_PRIORITY of the "
        "environment overrides it",
    )
    check_cpu: bool = key(
        True,
        "realtime: refuse to begin on a computer that the agents' ticks alone would keep busier "
        "than it can be, as measured before",
    )


@dataclass(frozen=True, slots=True)
class BridgeConfig:
    """How a bridge reaches its robot, and the limits that it keeps whatever an agent asks for."""

    endpoint: str = key("", "A1, Go1: where the robot is, HOST:PORT; empty: 192.168.123.10:8007")
    listen: str = key(
        "", "A1, Go1: where its packets arrive, HOST:PORT; empty: port 8080 (A1) or 8090 (Go1)"
    )
    interface: str = key(
        "", "Go2: its network interface, such as eth0; {number}: of the robot; lo: simulated ones"
    )
    domain: int = number(0, "1", 0, 200, "Go2: number of its DDS domain; on lo that of r1")
    period_ms: int = number(
        0, "ms", 0, 2, "between two states, and two commands; 0: 1 for A1 and Go1, 2 for Go2"
    )
    torque_share: float = number(0.9, "1", 0.05, 1.0, "share of a motor's greatest torque")
    torque_rate: float = number(8.0, "N·m/ms", 0.1, 100.0, "how fast that torque may change")
    speed_share: float = number(0.95, "1", 0.1, 1.5, "share of a joint's greatest speed")
    speed_ms: int = number(50, "ms", 0, 100, "how long a joint may be faster")
    power_max: float = number(900.0, "W", 10.0, 5000.0, "mechanical power of all motors")
    joint_margin: float = number(0.02, "rad", 0.0, 0.3, "distance kept from a joint's end stops")
    tilt_max: float = number(0.9, "rad", 0.1, 3.2, "tilt of the trunk at which the robot stops")
    battery_min: int = number(20, "%", 0, 100, "charge to stand up; at half it stops")
    report_share: float = number(
        0.8, "1", 0.01, 1.0, "share of a second's packets that must come before it is commanded"
    )
    report_max_ms: int = number(70, "ms", 5, 1000, "age of its last packet at which it stops")
    hold_ms: int = number(20, "ms", 2, 200, "age of a command from which on the joints are held")
    damp_ms: int = number(70, "ms", 4, 1000, "age at which the robot stops; Linux stalls 54 ms")
    passive_s: float = number(
        3.0, "s", 0.1, 60.0, "how long a robot that stops is damped before its motors are off"
    )
    stand_kp: float = number(80.0, "N·m/rad", 1.0, 300.0, "stiffness while the bridge moves it")
    stand_kd: float = number(4.0, "N·m·s/rad", 0.1, 20.0, "damping likewise")
    stand_s: float = number(3.0, "s", 1.0, 30.0, "how long standing up takes, and lying down")

    def of_robot(self, name: str) -> BridgeConfig:
        """The section for the robot of this name, with its number filled in."""
        number = name.removeprefix("r")
        # Robots on one loopback, which real ones are not, have DDS domains of their own.
        domain = self.domain + (int(number) - 1 if self.interface == "lo" else 0)
        keys = ("interface", "endpoint", "listen")
        filled = {key: getattr(self, key).replace("{number}", number) for key in keys}
        return replace(self, domain=domain, **filled)


@dataclass(frozen=True, slots=True)
class Config:
    """The configuration of a team, one section per field."""

    team: TeamConfig = field(default_factory=TeamConfig)
    bus: BusConfig = field(default_factory=BusConfig)
    plant: PlantConfig = field(default_factory=PlantConfig)
    world: WorldConfig = field(default_factory=WorldConfig)
    sensors: SensorsConfig = field(default_factory=SensorsConfig)
    motors: MotorsConfig = field(default_factory=MotorsConfig)
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    gait: GaitConfig = field(default_factory=GaitConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    identification: IdentificationConfig = field(default_factory=IdentificationConfig)
    reference: ReferenceConfig = field(default_factory=ReferenceConfig)
    recorder: RecorderConfig = field(default_factory=RecorderConfig)
    runtime: RuntimeConfig = field(default_factory=RuntimeConfig)
    bridge: BridgeConfig = field(default_factory=BridgeConfig)

    @property
    def robot(self) -> RobotSpec:
        """The kind of robot that the team is made of.

        Raises:
            ConfigError: it is that of a recording, and not known here.
        """
        kind = self.team.robot
        if kind not in ROBOTS:
            known = f"one of {', '.join(ROBOTS)}"
            raise ConfigError("team.robot", repr(kind), known, "install what brings this robot")
        return ROBOTS[kind]

    @property
    def feet_measure_newtons(self) -> bool:
        """Whether foot forces of messages are N, and not counts of unknown scale and bias."""
        return self.team.plant == SIMULATED and self.sensors.foot_sensor == "newtons"

    @property
    def response_file(self) -> str:
        """The file of measured responses for a team of this size; empty if none is configured."""
        return self.identification.response.replace("{robots}", str(self.team.robots))
