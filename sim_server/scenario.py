"""What happens to the team, and when: pushes, loads and the events that announce them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.config import Config
from shared.errors import ConfigError
from shared.messages import Event
from shared.robot import Array, robot_names

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


@dataclass(frozen=True, slots=True)
class Scenario:
    """The disturbances of a run and its announcements, by tick."""

    n: int
    pushes: tuple[Push, ...]
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


def build_scenario(config: Config, payload: Array) -> Scenario:
    """The scenario of a configuration.

    Args:
        config: the configuration.
        payload: load on each robot, shape (n,), kg.

    Raises:
        ConfigError: `world.push` does not parse or names an unknown robot.
    """
    names = robot_names(config.team.robots)
    pushes = parse_pushes(config.world.push, names)
    world = config.world
    events = [event(0, "start", "", f"{len(names)} robots, {config.team.yokes} yokes")]
    ground = "flat" if world.terrain == "flat" else (
        f"{world.terrain} up to {world.terrain_height:g} m, seed {world.seed}"
    )  # fmt: skip
    events.append(event(0, "terrain", "", ground))
    events += [
        event(0, "payload", name, f"{load:.6g} kg")
        for name, load in zip(names, payload.tolist(), strict=True)
        if load > 0.0
    ]
    for push in sorted(pushes, key=lambda item: item.start):
        detail = (
            f"{push.force:g} N towards {math.degrees(push.direction):g} deg"
            f" for {(push.stop - push.start) / 1000:g} s"
        )
        events += [event(push.start, "push", names[i], detail) for i in push.robots]
    return Scenario(n=len(names), pushes=pushes, events=tuple(events))


def parse_pushes(text: str, names: tuple[str, ...]) -> tuple[Push, ...]:
    """The pushes that `world.push` describes, in the order written; empty text means none.

    Raises:
        ConfigError: the text does not follow the grammar, or names a robot not in `names`.
    """
    return tuple(_parse_push(part.strip(), names) for part in text.split(",")) if text else ()


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


def event(tick: int, kind: str, robot: str, detail: str) -> Event:
    """The announcement of something that happened at `tick`."""
    return Event(tick=tick, stamp_ns=tick * 1_000_000, kind=kind, robot=robot, detail=detail)
