"""Robots on a stand: joints with a stiffness go where they are told, and nothing else moves."""

from collections.abc import Mapping

import numpy as np

from quadriga.plant.protocol import Plant
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Command, Event, State

LAG = 20.0  # ticks, in which a joint has gone two thirds of its way
LEVEL, STILL, UP = np.array([1.0, 0, 0, 0]), np.zeros(3), np.array([0, 0, 9.81])
FEET = np.full(4, 30.0)  # N


class Puppets(Plant):
    """The robots with these names, each as twelve joint angles."""

    def __init__(self, config: Config, names: tuple[str, ...]) -> None:
        self.names, self.tick = names, 0
        self.q = dict.fromkeys(names, config.robot.q_stand)
        self.v = {name: np.zeros(12) for name in names}

    def states(self) -> dict[str, State]:
        still = (np.zeros(12), LEVEL, STILL, UP, FEET)
        time = (self.tick, 1_000_000 * self.tick)
        return {name: State(*time, self.q[name], self.v[name], *still) for name in self.names}

    def step(self, commands: Mapping[str, Command]) -> tuple[Event, ...]:
        for name in self.names:
            goal = self.q[name]
            if name in commands:
                goal = np.where(commands[name].kp > 0.0, commands[name].q_des, goal)
            self.v[name] = 1000.0 * (goal - self.q[name]) / LAG
            self.q[name] = self.q[name] + 0.001 * self.v[name]
        self.tick += 1
        return ()
