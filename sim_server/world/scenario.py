"""What happens to the team by tick: loads, pushes, motors that weaken; and their events."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

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
_MOTOR: Final = "'robot:joint:start[s]' or 'robot:joint:start[s]:share', commas between motors"
_SHARE: Final = "0.6"  # of its torque that a weak motor gives where none is said
LATEST: Final = 3600.0  # s
_PUSH_NUMBERS: Final = (  # least and most; beyond 5000 N the world is no longer stable
    ("force", 0.0, 5000.0),
    ("direction", -360.0, 360.0),
    ("start", 0.0, LATEST),
    ("duration", 1e-3, LATEST),
)
_ANY: Final = "any"
_JOINTS: Final = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)


@dataclass(frozen=True, slots=True)
class Load:
    """A robot's external load."""

    mass: float  # kg; 0 if there is none
    offset: tuple[float, float] = (0.0, 0.0)  # of its centre from the trunk's, along its x, y, m

    @property
    def detail(self) -> str:
        """Detail of the event that announces the load."""
        x, y = self.offset
        where = f", {1000 * x:+.0f} mm ahead, {1000 * y:+.0f} mm left" if x or y else ""
        return f"{self.mass:.6g} kg{where}"


class Push(NamedTuple):
    """A constant horizontal force on the trunk's centre of mass, ticks `start` to `stop` − 1."""

    robots: tuple[int, ...]  # indices of the robots pushed, each with the whole force
    force: float  # N
    direction: float  # rad, world frame; 0 is along x (forward at the start), π/2 is left
    start: int  # tick, ms
    stop: int

    @property
    def detail(self) -> str:
        """Detail of the event that announces the push."""
        towards = f"{self.force:g} N towards {math.degrees(self.direction):g} deg"
        return f"{towards} for {(self.stop - self.start) / 1000:g} s"


class WeakMotor(NamedTuple):
    """A motor that gives only `share` of a sound one's torque from tick `start` on."""

    robot: int  # its index
    joint: int  # its index in `JOINT_NAMES`
    start: int  # tick, ms
    share: float


class Scenario(NamedTuple):
    """The disturbances of a run and the events that announce them."""

    forces: Mapping[int, Array]  # on each robot from a tick on, (n, 3), N, world frame
    strength: Mapping[int, Array]  # share of torque of each motor from a tick on, (n, 12)
    events: tuple[Event, ...]


def build_scenario(config: Config, loads: Sequence[Load]) -> Scenario:
    """The scenario of a configuration whose robots carry these loads.

    Raises:
        ConfigError: `world.push` or `world.motor_strength` does not parse or names no robot.
    """
    names, world = robot_names(config.team.robots), config.world
    pushes = parse_pushes(world.push, names)
    pushes += push_series(config, np.random.default_rng((world.seed, _PUSHES)))
    weak = weak_motors(config, np.random.default_rng((world.seed, _MOTORS)))
    ground = world.ground
    ground += f", seed {world.seed}" if TERRAINS[world.terrain].builder else ""
    events = [Event.of(0, codes.START, "", f"{len(names)} robots, {config.team.yokes} yokes")]
    events.append(Event.of(0, codes.TERRAIN, "", ground))
    for name, load in zip(names, loads, strict=True):
        if load.mass > 0.0:
            events.append(Event.of(0, codes.PAYLOAD, name, load.detail))
    for robot, joint, start, share in weak:
        detail = f"{_JOINTS[joint]} gives {100 * share:g} % of its torque"
        events.append(Event.of(start, codes.WEAK_MOTOR, names[robot], detail))
    for push in sorted(pushes, key=lambda item: item.start):
        events += [Event.of(push.start, codes.PUSH, names[i], push.detail) for i in push.robots]
    n = len(names)
    forces = {tick: np.zeros((n, 3)) for push in pushes for tick in (push.start, push.stop)}
    for push in pushes:
        vector = push.force * np.array([math.cos(push.direction), math.sin(push.direction), 0.0])
        for tick, total in forces.items():
            if push.start <= tick < push.stop:
                total[list(push.robots)] += vector
    strength = {motor.start: np.ones((n, N_JOINTS)) for motor in weak}
    for robot, joint, start, share in weak:
        for tick, shares in strength.items():
            if start <= tick:
                shares[robot, joint] = min(shares[robot, joint], share)
    return Scenario(forces, strength, tuple(events))


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


def read_items(
    key: str, text: str, grammar: str, counts: Collection[int], separator: str | None = ":"
) -> Iterator[tuple[str, list[str]]]:
    """The items between commas, each with its words; `ConfigError` at another count of these."""
    for item in text.split(",") if text else ():
        words = [word.strip() for word in item.split(separator)]
        if len(words) not in counts:
            raise ConfigError(key, repr(item.strip()), grammar)
        yield item.strip(), words


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
    pushes = list[Push]()
    for part, (robot, *numbers) in read_items("world.push", text, _PUSH, (5,)):
        if robot != "all" and robot not in names:
            raise ConfigError("world.push", f"robot {robot!r}", f"'all' or one of {list(names)}")
        force, direction, start, duration = (
            read_number("world.push", what, word, part, low, high)
            for word, (what, low, high) in zip(numbers, _PUSH_NUMBERS, strict=True)
        )
        first, ms = round(start * 1000), round(duration * 1000)
        robots = tuple(range(len(names))) if robot == "all" else (names.index(robot),)
        pushes.append(Push(robots, force, math.radians(direction), first, first + ms))
    return tuple(pushes)


def read_number(key: str, what: str, word: str, part: str, least: float, most: float) -> float:
    """A number of a key's text, which must be one and within its limits.

    Raises:
        ConfigError: it is not.
    """
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not least <= value <= most:  # this way round, it refuses what is not a number, too
        raise ConfigError(key, f"{what} {word!r} in {part!r}", f"{least:g} … {most:g}")
    return value


def weak_motors(config: Config, random: np.random.Generator) -> tuple[WeakMotor, ...]:
    """The motors that `world.motor_strength` describes, in the order written.

    Raises:
        ConfigError: the text does not follow the grammar, or names no such robot or joint.
    """
    key, names = "world.motor_strength", robot_names(config.team.robots)
    weak = list[WeakMotor]()
    for part, words in read_items(key, config.world.motor_strength, _MOTOR, (3, 4)):
        who, which, when, share = (*words, _SHARE)[:4]
        robots = [i for i, name in enumerate(names) if who in (name, _ANY)]
        joints = [i for i, name in enumerate(_JOINTS) if which in (name, *name.split("_"), _ANY)]
        if not robots:
            raise ConfigError(key, f"robot {who!r}", f"'any' or one of {', '.join(names)}")
        if not joints:
            expected = f"'any', a part, a leg or {_JOINTS[0]}"
            cause = "parts are hip, thigh, calf; legs are FL, FR, RL, RR"
            raise ConfigError(key, f"joint {which!r}", expected, cause)
        start = read_number(key, "start", when, part, 0.0, LATEST)
        gives = read_number(key, "share", share, part, 0.0, 1.0)
        robot, joint = int(random.choice(robots)), int(random.choice(joints))
        weak.append(WeakMotor(robot, joint, round(1000 * start), gives))
    return tuple(weak)
