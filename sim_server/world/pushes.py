"""Pushes: those that the configuration lists, and a series drawn from the seed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import robot_names

_GRAMMAR: Final = "'robot:force[N]:direction[deg]:start[s]:duration[s]', commas between pushes"
_FORCE_LIMIT: Final = 5000.0  # N; beyond it the world is no longer stable


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


def parse_pushes(text: str, names: tuple[str, ...]) -> tuple[Push, ...]:
    """The pushes that `world.push` describes, in the order written; empty text means none.

    Raises:
        ConfigError: the text does not follow the grammar, or names a robot not in `names`.
    """
    return tuple(_parse_push(part.strip(), names) for part in text.split(",")) if text else ()


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
    for k, due in enumerate(range(every, round(1000 * world.seconds), every)):
        left, share, late = random.random(3)
        start = due + int(late * 2 * config.gait.stance_ms)
        pushes.append(
            Push(
                robots=((first + k) % n,),
                force=world.push_force * (1.0 + world.push_spread * (2.0 * share - 1.0)),
                direction=math.copysign(math.pi / 2.0, left - 0.5),
                start=start,
                stop=start + duration,
            )
        )
    return tuple(pushes)


def all_pushes(config: Config, random: np.random.Generator) -> tuple[Push, ...]:
    """All pushes of a configuration.

    Raises:
        ConfigError: `world.push` does not parse or names an unknown robot.
    """
    written = parse_pushes(config.world.push, robot_names(config.team.robots))
    return written + push_series(config, random)


def _parse_push(part: str, names: tuple[str, ...]) -> Push:
    fields = part.split(":")
    if len(fields) != 5:
        raise ConfigError("world.push", repr(part), _GRAMMAR)
    robot = fields[0].strip()
    if robot != "all" and robot not in names:
        raise ConfigError("world.push", f"robot {robot!r}", f"'all' or one of {list(names)}")
    try:
        force, direction, start, duration = (float(word) for word in fields[1:])
    except ValueError:
        raise ConfigError("world.push", repr(part), _GRAMMAR, "a number is missing") from None
    _check(part, "force", force, 0.0, _FORCE_LIMIT)
    _check(part, "direction", direction, -360.0, 360.0)
    _check(part, "start", start, 0.0, 3600.0)
    _check(part, "duration", duration, 1e-3, 3600.0)
    first = round(start * 1000)
    return Push(
        robots=tuple(range(len(names))) if robot == "all" else (names.index(robot),),
        force=force,
        direction=math.radians(direction),
        start=first,
        stop=first + round(duration * 1000),
    )


def _check(part: str, what: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ConfigError(
            "world.push", f"{what} {value:g} in {part!r}", f"a {what} of {low:g} … {high:g}"
        )
