"""What happens to the team by tick: loads, pushes, motors that weaken; and their events."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.shared import codes
from quadriga.shared.config.per_robot import carriers
from quadriga.shared.config.sections import Config
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Event
from quadriga.shared.robots.conventions import JOINT_NAMES, N_JOINTS, Array, robot_names

_PUSHES, _MOTORS, _LOADS = 3, 4, 5  # streams of the seed: a new push changes no motor
_PUSH: Final = "'robot:force[N]:direction[deg]:start[s]:duration[s]', commas between pushes"
_MOTOR: Final = "'robot:joint:start[s]', commas between motors"
_FORCE_LIMIT: Final = 5000.0  # N; beyond it the world is no longer stable
_LATEST: Final = 3600.0  # s
_ANY: Final = "any"
_JOINTS: Final = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)


@dataclass(frozen=True, slots=True)
class Load:
    """A robot's external load.

    Attributes:
        mass: kg; 0 if there is none.
        offset: of its centre from the trunk's, along the trunk's x and y, m.
    """

    mass: float
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def detail(self) -> str:
        """Detail of the event that announces the load."""
        x, y = self.offset
        where = f", {1000 * x:+.0f} mm ahead, {1000 * y:+.0f} mm left" if x or y else ""
        return f"{self.mass:.6g} kg{where}"


@dataclass(frozen=True, slots=True)
class Push:
    """A constant horizontal force on the trunk's centre of mass, ticks `start` to `stop` − 1.

    Attributes:
        robots: indices of the robots pushed, each with the whole force.
        force: N.
        direction: rad, world frame; 0 is along x (forward at the start), π/2 is left.
        start, stop: ticks, ms.
    """

    robots: tuple[int, ...]
    force: float
    direction: float
    start: int
    stop: int

    @property
    def detail(self) -> str:
        """Detail of the event that announces the push."""
        towards = f"{self.force:g} N towards {math.degrees(self.direction):g} deg"
        return f"{towards} for {(self.stop - self.start) / 1000:g} s"


@dataclass(frozen=True, slots=True)
class WeakMotor:
    """A motor that gives only `share` of its torque from tick `start` on.

    Attributes:
        robot: its index.
        joint: its index in `JOINT_NAMES`.
        start: tick, ms.
        share: of the torque that a sound motor would give.
    """

    robot: int
    joint: int
    start: int
    share: float

    @property
    def detail(self) -> str:
        """Detail of the event that announces the weakening."""
        return f"{_JOINTS[self.joint]} gives {100 * self.share:g} % of its torque"


@dataclass(frozen=True, slots=True)
class Scenario:
    """The disturbances of a run and its announcements, by tick."""

    n: int
    pushes: tuple[Push, ...]
    weak: tuple[WeakMotor, ...]
    events: tuple[Event, ...]

    def changes(self) -> frozenset[int]:
        """Ticks at which the pushing forces change."""
        return frozenset(t for push in self.pushes for t in (push.start, push.stop))

    def forces(self, tick: int) -> Array:
        """Sum of the pushes on each robot during `tick`. Shape (n, 3), N, world frame."""
        total = np.zeros((self.n, 3))
        for push in self.pushes:
            if push.start <= tick < push.stop:
                vector = [math.cos(push.direction), math.sin(push.direction), 0.0]
                total[list(push.robots)] += push.force * np.array(vector)
        return total

    def weakenings(self) -> frozenset[int]:
        """Ticks at which a motor weakens."""
        return frozenset(motor.start for motor in self.weak)

    def strength(self, tick: int) -> Array:
        """Share of its torque that each motor gives during `tick`. Shape (n, 12)."""
        strength = np.ones((self.n, N_JOINTS))
        for motor in self.weak:
            if motor.start <= tick:
                place = motor.robot, motor.joint
                strength[place] = min(strength[place], motor.share)
        return strength


def build_scenario(config: Config, loads: Sequence[Load]) -> Scenario:
    """The scenario of a configuration.

    Args:
        config: the configuration.
        loads: the load on each robot.

    Raises:
        ConfigError: `world.push` or `world.weak_motor` does not parse or names an unknown robot.
    """
    names, world = robot_names(config.team.robots), config.world
    pushes = parse_pushes(world.push, names)
    pushes += push_series(config, np.random.default_rng((world.seed, _PUSHES)))
    weak = weak_motors(config, np.random.default_rng((world.seed, _MOTORS)))
    ground = world.ground
    ground += f", seed {world.seed}" if TERRAINS[world.terrain].builder else ""
    events = [Event.of(0, codes.START, "", f"{len(names)} robots, {config.team.yokes} yokes")]
    events.append(Event.of(0, codes.TERRAIN, "", ground))
    events += [
        Event.of(0, codes.PAYLOAD, name, load.detail)
        for name, load in zip(names, loads, strict=True)
        if load.mass > 0.0
    ]
    events += [Event.of(m.start, codes.WEAK_MOTOR, names[m.robot], m.detail) for m in weak]
    for push in sorted(pushes, key=lambda item: item.start):
        events += [Event.of(push.start, codes.PUSH, names[i], push.detail) for i in push.robots]
    return Scenario(n=len(names), pushes=pushes, weak=weak, events=tuple(events))


def build_loads(config: Config) -> tuple[Load, ...]:
    """The load on each robot; its place is drawn independently of the other robots' loads.

    Raises:
        ConfigError: `world.payload_on` does not parse or names no robot of the team.
    """
    world, n = config.world, config.team.robots
    parts = carriers(world.payload_on, robot_names(n))
    random, reach = np.random.default_rng((world.seed, _LOADS)), world.payload_scatter
    places = random.uniform(-reach, reach, (n, 2)).tolist()
    return tuple(
        Load(world.payload * part / sum(parts), (x, y) if reach else (0.0, 0.0))
        for part, (x, y) in zip(parts, places, strict=True)
    )


def push_series(config: Config, random: np.random.Generator) -> tuple[Push, ...]:
    """The pushes of `world.push_force`: one every `push_every`, on the robots in turn.

    The seed determines the robot pushed first, the side of each push, its force within
    `push_spread`, and a delay of up to one period of the gait, so that pushes come in any phase of
    a step.
    """
    world, n = config.world, config.team.robots
    if world.push_force == 0.0:
        return ()
    every, duration = round(1000 * world.push_every), round(1000 * world.push_duration)
    first = int(random.integers(n))
    pushes = []
    for k, due in enumerate(range(every, round(1000 * world.duration), every)):
        left, share, late = random.random(3)
        start = due + int(late * 2 * config.gait.stance_ms)
        force = world.push_force * (1.0 + world.push_spread * (2.0 * share - 1.0))
        direction = math.copysign(math.pi / 2.0, left - 0.5)
        pushes.append(Push(((first + k) % n,), force, direction, start, start + duration))
    return tuple(pushes)


def parse_pushes(text: str, names: tuple[str, ...]) -> tuple[Push, ...]:
    """The pushes that `world.push` describes, in the order written; empty text means none.

    Raises:
        ConfigError: the text does not follow the grammar, or names a robot not in `names`.
    """
    return tuple(_parse_push(part.strip(), names) for part in text.split(",")) if text else ()


def _parse_push(part: str, names: tuple[str, ...]) -> Push:
    robot, *numbers = (word.strip() for word in part.split(":"))
    if len(numbers) != 4:
        raise ConfigError("world.push", repr(part), _PUSH)
    if robot != "all" and robot not in names:
        raise ConfigError("world.push", f"robot {robot!r}", f"'all' or one of {list(names)}")
    try:
        force, direction, start, duration = (float(word) for word in numbers)
    except ValueError:
        raise ConfigError("world.push", repr(part), _PUSH, "a number is missing") from None
    for what, value, low, high in (
        ("force", force, 0.0, _FORCE_LIMIT),
        ("direction", direction, -360.0, 360.0),
        ("start", start, 0.0, _LATEST),
        ("duration", duration, 1e-3, _LATEST),
    ):
        if not low <= value <= high:
            expected = f"a {what} of {low:g} … {high:g}"
            raise ConfigError("world.push", f"{what} {value:g} in {part!r}", expected)
    first, ms = round(start * 1000), round(duration * 1000)
    robots = tuple(range(len(names))) if robot == "all" else (names.index(robot),)
    return Push(robots, force, math.radians(direction), first, first + ms)


def weak_motors(config: Config, random: np.random.Generator) -> tuple[WeakMotor, ...]:
    """The motors that `world.weak_motor` describes, in the order written.

    Raises:
        ConfigError: the text does not follow the grammar, or names no such robot or joint.
    """
    text, names = config.world.weak_motor, robot_names(config.team.robots)
    if not text:
        return ()
    share = config.world.weak_share
    return tuple(_parse_motor(part.strip(), names, share, random) for part in text.split(","))


def _parse_motor(
    part: str, names: tuple[str, ...], share: float, random: np.random.Generator
) -> WeakMotor:
    key, fields = "world.weak_motor", [word.strip() for word in part.split(":")]
    if len(fields) != 3:
        raise ConfigError(key, repr(part), _MOTOR)
    robots = [i for i, name in enumerate(names) if fields[0] in (name, _ANY)]
    joints = [i for i, name in enumerate(_JOINTS) if fields[1] in (name, *name.split("_"), _ANY)]
    if not robots:
        raise ConfigError(key, f"robot {fields[0]!r}", f"'any' or one of {', '.join(names)}")
    if not joints:
        expected = f"'any', a part, a leg or {_JOINTS[0]}"
        cause = "parts are hip, thigh, calf; legs are FL, FR, RL, RR"
        raise ConfigError(key, f"joint {fields[1]!r}", expected, cause)
    try:
        start = float(fields[2])
    except ValueError:
        start = math.nan
    if not 0.0 <= start <= _LATEST:
        raise ConfigError(key, f"start {fields[2]!r} in {part!r}", f"0 … {_LATEST:g} s")
    robot, joint = int(random.choice(robots)), int(random.choice(joints))
    return WeakMotor(robot, joint, round(1000 * start), share)
