"""The whole configuration: frozen dataclasses; every key has a default, a unit and limits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final


def key(
    default: Any,
    unit: str,
    doc: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """Declare a configuration key: its default, unit, meaning and permitted range."""
    meta = {"unit": unit, "doc": doc, "low": low, "high": high, "choices": choices}
    if isinstance(default, (list, dict)):
        raise TypeError("a default must be immutable")
    return field(default=default, metadata=meta)


@dataclass(frozen=True, slots=True)
class TeamConfig:
    """Who walks together."""

    name: str = key("team", "-", "first part of every key; teams on one network need own names")
    robots: int = key(3, "1", "number of robots r1 … rn", low=1, high=10)
    yokes: str = key(
        "complete", "-", "which pairs are yoked", choices=("complete", "chain", "ring")
    )
    spacing: float = key(0.9, "m", "distance between neighbours at the start", low=0.6, high=3.0)
    alternate_phase: bool = key(True, "-", "every second robot trots half a gait period later")


@dataclass(frozen=True, slots=True)
class BusConfig:
    """How the processes reach each other over Zenoh."""

    mode: str = key(
        "peer",
        "-",
        "peer: processes connect directly; client: all through a router",
        choices=("peer", "client"),
    )
    endpoint: str = key(
        "tcp/127.0.0.1:7447", "-", "where the sim server listens (peer) or the router is (client)"
    )
    listen: str = key(
        "tcp/127.0.0.1:0", "-", "peer mode: where every other process listens; port 0: any free one"
    )
    barrier_timeout: float = key(
        60.0, "s", "how long to wait for all processes before giving up", low=0.1, high=3600.0
    )


@dataclass(frozen=True, slots=True)
class WorldConfig:
    """The simulated world and its seeded disturbances."""

    mode: str = key(
        "lockstep",
        "-",
        "lockstep waits for every command; realtime is paced by the clock",
        choices=("lockstep", "realtime"),
    )
    seed: int = key(0, "-", "seed of terrain, noise and everything else random", low=0, high=2**31)
    seconds: float = key(20.0, "s", "world time to walk", low=0.5, high=3600.0)
    scenario: str = key("", "-", "name of the scenario these keys come from: a label only")
    scatter: float = key(
        0.0,
        "m",
        "how far a robot may start off its place along x and y, drawn from the seed",
        low=0.0,
        high=0.1,
    )
    terrain: str = key(
        "flat",
        "-",
        "what is under the feet; gravel: stones that lie fixed; pebbles: a layer of stones that "
        "lie loose; slope: ramps up and down",
        choices=("flat", "boxes", "gravel", "heightfield", "pebbles", "slope"),
    )
    terrain_height: float = key(
        0.05,
        "m",
        "greatest height of the terrain; of pebbles: height of the largest, at least 0.005",
        low=0.0,
        high=0.3,
    )
    slope: float = key(8.0, "deg", "terrain slope: grade of the ramps", low=0.5, high=25.0)
    friction: float = key(0.8, "1", "friction coefficient of feet on ground", low=0.05, high=2.0)
    payload: float = key(0.0, "kg", "load unknown to the agents", low=0.0, high=60.0)
    payload_on: str = key(
        "team",
        "-",
        "who carries the load: 'team' (equal shares), or names separated by commas, each with a "
        "share if they are not equal: 'r1:6,r3:4'",
    )
    payload_scatter: float = key(
        0.0,
        "m",
        "how far a load may lie off the trunk's centre along x and y, drawn from the seed",
        low=0.0,
        high=0.15,
    )
    push: str = key(
        "",
        "-",
        "pushes 'robot:force[N]:direction[deg]:start[s]:duration[s]' separated by commas; "
        "robot may be 'all'; direction 0 is forward, 90 is left",
    )
    push_force: float = key(
        0.0,
        "N",
        "a series of sideways pushes on the robots in turn; side, exact times and who is first "
        "are drawn from the seed; 0: none",
        low=0.0,
        high=5000.0,
    )
    push_spread: float = key(
        0.0,
        "1",
        "share of push_force by which a push may be weaker or stronger, drawn",
        low=0.0,
        high=1.0,
    )
    push_every: float = key(3.0, "s", "from push to push, and until the first", low=0.1, high=600.0)
    push_duration: float = key(0.2, "s", "of each push of the series", low=1e-3, high=10.0)
    weak_motor: str = key(
        "",
        "-",
        "motors that weaken: 'robot:joint:start[s]' separated by commas; joint as FL_calf, calf or "
        "FL, either may be 'any', and what is left open is drawn from the seed",
    )
    weak_share: float = key(
        0.6, "1", "share of its torque that a weak motor still gives", low=0.0, high=1.0
    )
    command_timeout: float = key(
        10.0,
        "s wall",
        "lockstep: a robot silent longer is put into damping; with a planner at least 1 s more "
        "than planner.peer_timeout",
        low=0.05,
        high=60.0,
    )
    command_hold_ms: int = key(
        20, "ms", "realtime: a command older than this is replaced by holding", low=1, high=1000
    )
    command_damp_ms: int = key(
        200, "ms", "realtime: a command older than this is replaced by damping", low=1, high=10000
    )

    @property
    def uneven(self) -> bool:
        """Whether the ground is anything but a plane."""
        return self.terrain != "flat" and self.terrain_height > 0.0


@dataclass(frozen=True, slots=True)
class SensorsConfig:
    """Noise and bias of the simulated sensors (standard deviations)."""

    joint_position: float = key(5e-4, "rad", "encoder noise", low=0.0, high=0.1)
    joint_velocity: float = key(0.05, "rad/s", "encoder rate noise", low=0.0, high=5.0)
    joint_torque: float = key(0.1, "N·m", "torque noise", low=0.0, high=10.0)
    gyro: float = key(0.01, "rad/s", "gyro noise", low=0.0, high=1.0)
    gyro_bias: float = key(0.002, "rad/s", "gyro bias, drawn once per run", low=0.0, high=1.0)
    accel: float = key(0.1, "m/s²", "accelerometer noise", low=0.0, high=10.0)
    accel_bias: float = key(0.02, "m/s²", "accelerometer bias, drawn once", low=0.0, high=5.0)
    orientation: float = key(1e-3, "rad", "IMU attitude noise", low=0.0, high=0.2)
    foot_force: float = key(1.0, "N", "foot force noise", low=0.0, high=50.0)


@dataclass(frozen=True, slots=True)
class EstimatorConfig:
    """The agent's Kalman filter on IMU and leg kinematics."""

    kind: str = key(
        "kalman",
        "-",
        "truth takes the simulator's word, for comparison only",
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
    contact_force: float = key(10.0, "N", "no trust in a foot loaded less", low=0.0, high=200.0)


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
        "robust, soft (lets planned forces through) or paper: replaces the defaults below",
        choices=("robust", "soft", "paper"),
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
        0.35, "1", "friction always counted on, slide as feet may", low=0.05, high=2.0
    )
    mu_recovery: float = key(
        2.0, "1/s", "how fast friction is counted on again after feet slid", low=0.0, high=10.0
    )
    slip_load: float = key(20.0, "N", "a foot that bears less may slide", low=0.0, high=200.0)
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
    contact_force: float = key(4.0, "N", "foot force that counts as contact", low=0.5, high=100.0)
    lost_contact_ms: int = key(5, "ms", "stance without force until it descends", low=1, high=100)
    descent_speed: float = key(0.8, "m/s", "speed of a descending stance foot", low=0.0, high=3.0)
    reject_side_contacts: bool = key(
        True,
        "-",
        "a foot stopped from the side is no contact, nor one that landed early and bears no load",
    )
    liftoff_hold_ms: int = key(
        0,
        "ms",
        "longest wait of a foot about to swing for those that shall stand; 0: none",
        low=0,
        high=1000,
    )
    reflex_ms: int = key(
        10,
        "ms",
        "a swing foot that stumbles rises until so long after it is free; 0: never",
        low=0,
        high=100,
    )
    reflex_lift: float = key(1.0, "m/s", "speed of a rising foot that stumbled", low=0.0, high=3.0)
    track_sinking_trunk: bool = key(
        True, "-", "a descending foot goes down with the trunk; feet are asked to where legs reach"
    )
    flight: bool = key(True, "-", "without contact the trunk is asked to fall freely")
    load_time: float = key(
        1.0,
        "s",
        "filter of the load that the feet feel; 0: the robot counts on none",
        low=0.0,
        high=100.0,
    )
    swing_delay: float = key(
        0.0, "1", "share of swing in which a foot rises before it goes forward", low=0.0, high=0.5
    )
    swing_acceleration: float = key(
        100.0,
        "m/s²",
        "footholds of swings begun late are near enough for no more than this",
        low=1.0,
        high=1e4,
    )
    ground_filter_ms: float = key(50.0, "ms", "filter of the ground height", low=0.0, high=1e3)
    swing_height: float = key(
        0.09, "m", "apex above the highest foothold (paper: above the ground)", low=0.01, high=0.2
    )
    raibert_gain: float = key(0.03, "s", "foothold per velocity error", low=0.0, high=0.5)
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


CENTRAL: Final = ("centralised", "deepc")  # kinds of planner that are one process for the team


@dataclass(frozen=True, slots=True)
class PlannerConfig:
    """The data-driven predictive planner."""

    preset: str = key(
        "usual",
        "-",
        "usual: plans every 40 ms, as in the paper; fast: every 10 ms and with weights of its own, "
        "for a network whose messages take less: replaces the defaults below",
        choices=("usual", "fast"),
    )
    kind: str = key(
        "distributed",
        "-",
        "distributed: each agent plans with its peers' last plans (eq. 12); decentralised: without "
        "its peers; centralised: one process plans for all (eq. 7); deepc: so does eq. 5; "
        "none: nominal forces",
        choices=("distributed", "decentralised", "centralised", "deepc", "none"),
    )
    compensation: bool = key(
        False, "-", "distributed: bring peers' windows and plans forward by their age"
    )
    damping: float = key(
        0.0, "1", "share of an agent's own last plan that its new one keeps", low=0.0, high=0.95
    )
    exchanges: int = key(
        0, "-", "distributed: best responses to the peers' plans of the same step", low=0, high=8
    )
    adaptation: str = key(
        "none",
        "-",
        "recursive: each agent corrects what its own forces do to it by what it measures, as with "
        "a payload nobody told of (distributed and decentralised)",
        choices=("none", "recursive"),
    )
    forgetting: float = key(
        0.995, "1", "adaptation: what a planning step leaves of older knowledge", low=0.5, high=1.0
    )
    latency_ms: int = key(
        8,
        "ms",
        "a plan made from data at t takes effect at t + this, at most 10·(N − applied)",
        low=0,
        high=100,
    )
    lambda_g: float = key(1e5, "1", "deepc: weight of ‖g‖²", low=1e-9, high=1e12)
    lambda_sigma: float = key(1e5, "1", "deepc: weight of ‖σ‖²", low=1e-9, high=1e15)
    interface: str = key(
        "feedforward",
        "-",
        "feedforward: force deviations become accelerations of the pre-stabilised trunk; "
        "force: planned forces and speeds are tracked by the whole-body QP (the paper)",
        choices=("feedforward", "force"),
    )
    footholds: str = key(
        "measured",
        "-",
        "velocity that footholds count on: measured, or as planned until the middle of the stance "
        "to come, as far as the plan reaches",
        choices=("measured", "planned"),
    )
    N: int = key(25, "samples", "control horizon", low=4, high=100)
    T_ini: int = key(10, "samples", "estimation horizon", low=2, high=50)
    applied: int = key(4, "samples", "samples applied before the next plan", low=1, high=20)
    Q: tuple[float, ...] = key(
        (1e6, 1e5, 1e5, 2e5, 2e5, 2e3), "-", "weights of z, vx, vy, roll, pitch, wz", low=0.0
    )
    R: tuple[float, ...] = key((0.2, 0.2, 0.05), "-", "weights of fx, fy, fz", low=1e-9)
    mu: float = key(0.6, "1", "friction coefficient of the planned forces", low=0.05, high=2.0)
    force_min: float = key(0.0, "N", "least planned normal force", low=0.0, high=50.0)
    deviation_max: tuple[float, ...] = key(
        (20.0, 20.0, 60.0), "N", "largest planned deviation from the nominal force", low=0.0
    )
    output_bounds: str = key(
        "none",
        "-",
        "whether planned outputs are bounded by output_max",
        choices=("none", "soft", "hard"),
    )
    output_max: tuple[float, ...] = key(
        (0.03, 0.4, 0.3, 0.15, 0.15, 0.8),
        "m, m/s, m/s, rad, rad, rad/s",
        "largest planned deviation of z, vx, vy, roll, pitch, wz from what is commanded",
        low=1e-6,
    )
    output_weight: float = key(
        100.0, "1", "soft output bounds: weight of their violation, times Q", low=1e-3, high=1e6
    )
    fade: tuple[float, ...] = key(
        (0.06, 0.5, 0.25, 2.0),
        "m, m/s, rad, rad/s",
        "the plan fades out as the state leaves this range of the data",
        low=1e-6,
    )
    solver: str = key("daqp", "-", "QP solver of the planner", choices=("daqp", "osqp"))
    max_peer_age: int = key(
        3, "planning steps", "a peer's plan older than this is no longer shifted", low=1, high=25
    )
    hold_steps: int = key(
        5, "planning steps", "a lost peer's terms are held this long, then stop", low=0, high=250
    )
    peer_timeout: float = key(
        5.0, "s wall", "lockstep: longest wait for a peer's plan", low=0.01, high=10.0
    )


@dataclass(frozen=True, slots=True)
class IdentificationConfig:
    """Data collection and the predictor's fit and gates."""

    seconds: float = key(
        0.0,
        "s",
        "world time collected for training; 0 takes what the team's size asks for",
        low=0.0,
        high=3600.0,
    )
    held_out: float = key(8.0, "s", "world time held out of the fit", low=2.0, high=600.0)
    episode: float = key(10.5, "s", "length of one episode", low=3.0, high=600.0)
    noise: tuple[float, ...] = key((15.0, 15.0, 35.0), "N", "force noise (std) fx, fy, fz", low=0.0)
    noise_hold_ms: int = key(20, "ms", "how long one draw of noise is held", low=10, high=500)
    vx: tuple[float, ...] = key((-0.2, 0.7), "m/s", "range of random forward speeds", low=-2.0)
    vy: tuple[float, ...] = key((-0.2, 0.2), "m/s", "range of random sideways speeds", low=-2.0)
    wz: tuple[float, ...] = key((-0.3, 0.3), "rad/s", "range of random yaw rates", low=-2.0)
    hold: float = key(1.5, "s", "how long a random speed is held", low=0.1, high=60.0)
    seed: int = key(1000, "-", "seed of the collection", low=0, high=2**31)
    predictor: str = key(
        "ridge",
        "-",
        "the fit of G; pinv: the paper's; ridge: regularised, block-weighted; gamma: LQ "
        "factorisation; causal: no force acts on outputs before it; arx: one-step model rolled "
        "out; phase: one G for each part of the gait's period",
        choices=("ridge", "pinv", "gamma", "causal", "arx", "phase"),
    )
    neighbours: str = key(
        "all",
        "-",
        "yoked: robots that are not yoked to each other are taken to be uncoupled",
        choices=("all", "yoked"),
    )
    phases: int = key(2, "1", "parts of the gait's period of the predictor 'phase'", low=1, high=40)
    ridge: float = key(1e-3, "1", "ridge per data column", low=1e-12, high=1e3)
    phase_ridge: float = key(
        30.0,
        "1",
        "predictor 'phase': ridge on what a phase departs from the fit of all data",
        low=1e-12,
        high=1e6,
    )
    block_weight: float = key(
        160.0, "1", "extra penalty weight w (as w²) on the columns of peers", low=1.0, high=1e4
    )
    order_per_robot: int = key(
        12,
        "states",
        "assumed system order n = this · robots, for T ≥ (m+1)(T_ini+N+n)−1",
        low=1,
        high=100,
    )
    max_radius: float = key(
        0.5, "1", "gate: spectral radius of the best-response map", low=0.01, high=10.0
    )
    gain_range: tuple[float, ...] = key(
        (0.3, 2.0), "1", "gate: predicted over physical height response", low=-10.0
    )


@dataclass(frozen=True, slots=True)
class ReferenceConfig:
    """What the operator asks for once the team walks."""

    vx: float = key(0.5, "m/s", "forward speed", low=-1.0, high=1.2)
    vy: float = key(0.0, "m/s", "leftward speed", low=-0.5, high=0.5)
    wz: float = key(0.0, "rad/s", "yaw rate", low=-1.0, high=1.0)
    height: float = key(0.26, "m", "trunk height above the ground", low=0.2, high=0.32)
    ramp: float = key(1.0, "s", "time from standing to full speed", low=0.0, high=20.0)
    trace: str = key(
        "",
        "-",
        "CSV with columns t [s], vx, vy, wz that replaces these three, over and over: a path with "
        "a '/', which is read at once, its lines kept here with a ';' between them; or the name of "
        "a file beside the scenarios",
    )
    trace_shift: float = key(
        0.0,
        "s",
        "the trace begins at a time from 0 to this, drawn from world.seed",
        low=0.0,
        high=3600.0,
    )


@dataclass(frozen=True, slots=True)
class RecorderConfig:
    """The recording of all traffic."""

    enabled: bool = key(True, "-", "the team waits for the recorder before it walks")
    chunk_kib: int = key(
        256, "KiB", "largest MCAP chunk; smaller ones are closed every 50 ms", low=16, high=65536
    )


@dataclass(frozen=True, slots=True)
class RuntimeConfig:
    """How the operating system runs the processes."""

    priority: str = key(
        "realtime",
        "-",
        "realtime: agents, planner and sim server go before ordinary processes (SCHED_RR) if the "
        "user may do so; ordinary: they do not",
        choices=("realtime", "ordinary"),
    )


@dataclass(frozen=True, slots=True)
class Config:
    """The configuration of a team, one section per field."""

    team: TeamConfig = field(default_factory=TeamConfig)
    bus: BusConfig = field(default_factory=BusConfig)
    world: WorldConfig = field(default_factory=WorldConfig)
    sensors: SensorsConfig = field(default_factory=SensorsConfig)
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    gait: GaitConfig = field(default_factory=GaitConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    identification: IdentificationConfig = field(default_factory=IdentificationConfig)
    reference: ReferenceConfig = field(default_factory=ReferenceConfig)
    recorder: RecorderConfig = field(default_factory=RecorderConfig)
    runtime: RuntimeConfig = field(default_factory=RuntimeConfig)
