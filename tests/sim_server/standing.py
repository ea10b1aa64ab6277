"""Worlds to test with and commands that make their robots stand."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import mujoco
import numpy as np

from quadriga.shared.config.presets import PRESETS
from quadriga.shared.config.sections import (
    Config,
    MotorsConfig,
    SensorsConfig,
    TeamConfig,
    WorldConfig,
)
from quadriga.shared.messages import Command
from quadriga.shared.robots.conventions import N_JOINTS
from quadriga.sim_server.world.world import World
from tests.a1 import q_stand

# The names of the sensors' noise and biases: what is left of sensors that measure N.
NOISE = [
    item.name
    for item in fields(SensorsConfig)
    if (item.type == "float" and not item.name.startswith("foot_")) or item.name == "foot_force"
]
SILENT = SensorsConfig(preset="ideal", foot_sensor="newtons", **dict.fromkeys(NOISE, 0.0))
# Motors that give at once what is commanded.
IDEAL_MOTORS = MotorsConfig(preset="ideal", **PRESETS["motors"]["ideal"])


def configured(
    robots: int = 1,
    *,
    yokes: str = "complete",
    noise: bool = False,
    motors: MotorsConfig = IDEAL_MOTORS,
    **world: Any,
) -> Config:
    """A team with ideal motors and silent sensors, where nothing else is said."""
    team, walked = TeamConfig(robots=robots, yokes=yokes), WorldConfig(**world)
    config = Config(team=team, world=walked, motors=motors)
    return config if noise else replace(config, sensors=SILENT)


def command(**values: Any) -> Command:
    arrays = {name: np.zeros(N_JOINTS) for name in ("tau", "q_des", "v_des", "kp", "kd")}
    for name, value in values.items():
        arrays[name] = np.broadcast_to(np.asarray(value, dtype=float), N_JOINTS)
    return Command(tick=0, stamp_ns=0, **arrays)


STAND = command(q_des=q_stand(), kp=200.0, kd=4.0)


def stand(world: World, ticks: int) -> None:
    for _ in range(ticks):
        world.step({name: STAND for name in world.names})


def shift(world: World, dx: float = 0.0, dz: float = 0.0) -> None:
    """Move the whole team at once, as no command could."""
    q = world.physics.qpos.reshape(len(world.names), -1)
    q[:, 0] += dx
    q[:, 2] += dz
    mujoco.mj_forward(world.team.model, world.physics)


def momentum(world: World) -> Any:
    """Linear momentum of everything, N·s, world frame."""
    world.settle()
    mujoco.mj_subtreeVel(world.team.model, world.physics)
    return world.team.model.body_subtreemass[0] * world.physics.subtree_linvel[0]
