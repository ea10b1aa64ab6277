"""One agent without a world, and what its outputs amount to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from quadriga.agents.agent import Agent, AgentState, Inputs, Outputs
from quadriga.shared.codec import encode
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.messages import Reference, State
from tests.a1 import standing
from tests.agents.duet import asked, over_the_bus, simple_predictor

ALONE = Config(team=TeamConfig(robots=1))

_LEAP = 0.09  # rad per tick


class Robot:
    """One agent that stands on imaginary ground whatever it does; a reference every 100 ms."""

    def __init__(self, config: Config = ALONE, *, planner: bool = False) -> None:
        self.agent = Agent(config, "r1", simple_predictor(config) if planner else None)
        self.state: AgentState = self.agent.initial()
        self.tick = 0
        self.references = True

    def step(self, state: State | None = None, **inputs: Any) -> Outputs:
        references: tuple[Reference, ...] = ()
        if self.references and self.tick % 100 == 0:
            references = (replace(asked(0.2), tick=self.tick),)
        self.state, outputs = self.agent.step(
            self.state, Inputs(state or standing(self.tick), references=references, **inputs)
        )
        self.tick += 1
        return outputs

    def run(self, until: int) -> Outputs:
        while self.tick < until:
            outputs = self.step()
        return outputs


def tilted(tick: int, roll: float) -> State:
    quat = np.array([np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0])
    return over_the_bus(replace(standing(tick), imu_quat_wxyz=quat))


def lean(robot: Robot, roll: float, begun: float = 0.0) -> Outputs:
    """Have a robot lean on, as fast as an attitude may change without its gyro, rad."""
    angles = np.linspace(begun, roll, 2 + int(abs(roll - begun) / _LEAP))
    for angle in angles[1:]:
        outputs = robot.step(tilted(robot.tick, angle))
    return outputs


def is_damping(outputs: Outputs, config: Config = ALONE) -> bool:
    command = outputs.command
    still = (command.tau, command.kp, command.q_des, command.v_des)
    return not any(array.any() for array in still) and bool(
        (command.kd == config.controller.damping).all()
    )


def sent(outputs: Outputs) -> list[bytes]:
    """What goes onto the bus."""
    messages = (outputs.command, outputs.measurement, outputs.plan)
    return [encode(message) for message in messages if message is not None]
