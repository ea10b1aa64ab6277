"""The section of the simulated world."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from quadriga.shared.config.key import key
from quadriga.shared.config.terrains import TERRAINS, terrain_meanings


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
    duration: float = key(20.0, "s", "world time to walk", low=0.5, high=3600.0)
    scenario: str = key("", "-", "name of the scenario these keys come from: a label only")
    initial_posture: str = key(
        "standing",
        "-",
        "how simulated robots begin: standing, or lying on their feet with folded legs",
        choices=("standing", "lying"),
    )
    scatter: float = key(
        0.0,
        "m",
        "how far a robot may start off its place along x and y, drawn from the seed",
        low=0.0,
        high=0.1,
    )
    terrain: str = key(
        "flat", "-", f"kind of ground; {terrain_meanings()}", choices=tuple(TERRAINS)
    )
    terrain_height: float = key(
        0.05,
        "m",
        "greatest height of the terrain; of pebbles: height of the largest, at least 0.005",
        low=0.0,
        high=0.3,
    )
    slope: float = key(8.0, "deg", "terrain slope: grade of the ramps", low=0.5, high=25.0)
    stairs_rise: float = key(0.06, "m", "terrain stairs: height of a step", low=0.0, high=0.2)
    stairs_run: float = key(0.3, "m", "terrain stairs: depth of a tread", low=0.1, high=2.0)
    stairs_count: int = key(8, "1", "terrain stairs: steps up, and down again", low=1, high=50)
    friction: float = key(0.8, "1", "friction coefficient of feet on ground", low=0.05, high=2.0)
    friction_of: str = key(
        "",
        "-",
        "robots whose feet find another friction, as on a slippery strip: 'r2:0.3', or several "
        "separated by commas",
    )
    leg_collisions: bool = key(
        True,
        "-",
        "hips, thighs and calves collide with the ground, thighs, calves, feet and trunks with "
        "those of other legs and robots; false: feet and trunks collide, and with the ground alone",
    )
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
        "a series of sideways pushes on the robots in turn; side, exact times and the robot "
        "pushed first are drawn from the seed; 0: none",
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
    push_every: float = key(
        3.0, "s", "time between two pushes, and before the first", low=0.1, high=600.0
    )
    push_duration: float = key(0.2, "s", "duration of each push of the series", low=1e-3, high=10.0)
    motor_strength: str = key(
        "",
        "-",
        "motors that weaken: 'robot:joint:start[s]:share' separated by commas; joint as FL_calf, "
        "calf or FL, either may be 'any', and what is left open is drawn from the seed; share of "
        "its torque that the motor still gives, 0.6 where none is said",
    )
    faults: str = key(
        "",
        "-",
        "faulty sensors and motors, 'robot/component kind start[s] [duration[s]]' separated by "
        "commas, as 'r2/imu stuck 4 2'; docs/world.md has the components and kinds",
    )
    live_faults: bool = key(
        False,
        "-",
        "sensors and motors may be made faulty while the team walks, by quadriga fault --live",
    )
    command_timeout: float = key(
        10.0,
        "s wall",
        "lockstep: the walk ends if a robot is silent for longer; with a planner at least 1 s more "
        "than planner.peer_timeout",
        low=0.05,
        high=60.0,
    )
    command_hold_ms: int = key(
        20, "ms", "realtime: a command older than this is replaced by holding", low=1, high=1000
    )
    command_damp_ms: int = key(
        200, "ms", "realtime: a command older than this is lost: the walk ends", low=1, high=10000
    )

    @property
    def uneven(self) -> bool:
        """Whether the ground is anything but a plane."""
        kind = TERRAINS[self.terrain]
        return bool(kind.builder) and getattr(self, kind.height_key) > 0.0

    @property
    def ground(self) -> str:
        """What the ground is, in words."""
        return TERRAINS[self.terrain].text.format_map(asdict(self))
