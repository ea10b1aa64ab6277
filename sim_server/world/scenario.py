"""Disturbances of the team by tick: pushes, loads, weak motors; and their events."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.robot.conventions import N_JOINTS, Array, robot_names
from quadriga.shared.wire import codes
from quadriga.shared.wire.messages import Event
from quadriga.sim_server.world.payload import Load
from quadriga.sim_server.world.pushes import Push, all_pushes
from quadriga.sim_server.world.weak_motors import WeakMotor, weak_motors

_PUSHES: Final = 3  # separate streams of the seed, so that a new push changes no motor
_MOTORS: Final = 4


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
    pushes = all_pushes(config, np.random.default_rng((world.seed, _PUSHES)))
    weak = weak_motors(config, np.random.default_rng((world.seed, _MOTORS)))
    events = [Event.of(0, codes.START, "", f"{len(names)} robots, {config.team.yokes} yokes")]
    events.append(Event.of(0, codes.TERRAIN, "", _ground(config)))
    events += [
        Event.of(0, codes.PAYLOAD, name, load.detail)
        for name, load in zip(names, loads, strict=True)
        if load.mass > 0.0
    ]
    events += [Event.of(m.start, codes.WEAK_MOTOR, names[m.robot], m.detail) for m in weak]
    for push in sorted(pushes, key=lambda item: item.start):
        detail = (
            f"{push.force:g} N towards {math.degrees(push.direction):g} deg"
            f" for {(push.stop - push.start) / 1000:g} s"
        )
        events += [Event.of(push.start, codes.PUSH, names[i], detail) for i in push.robots]
    return Scenario(n=len(names), pushes=pushes, weak=weak, events=tuple(events))


def _ground(config: Config) -> str:
    world = config.world
    return f"{world.ground}, seed {world.seed}" if TERRAINS[world.terrain].builder else world.ground
