"""The walk that the golden recording holds: two yoked robots, a push, a small planner."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.rollout import Rollout
from quadriga.shared.codec import decode, encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Message, State
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.topics import (
    COMMAND,
    EVENT,
    MEASUREMENT,
    PLAN,
    REFERENCE,
    REFERENCE_EPOCH_MS,
    STATE,
)
from quadriga.sim_server.world.world import World
from quadriga.team.operator import reference_at

FOLDER: Final = Path(__file__).parent
RECORDING: Final = FOLDER / "golden.mcap"
PREDICTOR: Final = FOLDER / "predictor.npz"
REASONS: Final = FOLDER / "REASONS.md"

# Short, and with a short horizon, so that recording and predictor stay small; a push, a turn and
# a short stand, so that most of the agent has something to do all the same. So little data need not
# tell what robots do to each other.
KEYS: Final = {
    "team.robots": 2, "world.seed": 5, "world.duration": 0.6, "world.push": "r2:150:90:0.3:0.1",
    "gait.stand_ms": 100, "reference.vx": 0.4, "reference.wz": 0.3, "reference.ramp": 0.2,
    "planner.N": 8, "planner.T_ini": 4, "identification.block_weight": 20.0,
    "identification.max_peers_harm": 1000.0, "identification.predictor": "ridge",
    "planner.compensation": False, "identification.disturbed": 0.0,
    "identification.noise": (15.0, 15.0, 35.0),
    "identification.wrench_noise": (0.0, 0.0, 0.0, 0.0, 0.0),
}  # fmt: skip
# What the predictor is fitted for; a standing time of its own would ask for walks of its own.
FITTED_FOR: Final = {
    key: value
    for key, value in KEYS.items()
    if key.startswith(("team", "planner", "identification"))
}
# Resolution of each sensor, a power of two: what is below it is noise that does not compress.
_RESOLUTION: Final = {
    "q_joint": 2.0**-12, "v_joint": 2.0**-6, "tau_joint": 2.0**-5, "imu_quat_wxyz": 2.0**-12,
    "imu_gyro": 2.0**-9, "imu_accel": 2.0**-7, "foot_force": 2.0**-2,
}  # fmt: skip

Sent = tuple[str, Message]


def config() -> Config:
    """The configuration of the golden walk."""
    return load(None, KEYS)


def walk(config: Config, predictor: Predictor) -> Iterator[Sent]:
    """All that the team sends and hears, in the order of a lock-step world."""
    team, names = config.team.name, robot_names(config.team.robots)
    asked = {
        tick: reference_at(config, tick)
        for tick in range(0, round(1000 * config.world.duration), REFERENCE_EPOCH_MS)
    }
    rollout = Rollout(config, predictor, asked.get)
    rollout.world = _CoarseWorld(config)
    for tick in range(round(1000 * config.world.duration)):
        if tick in asked:
            yield REFERENCE.key(team), asked[tick]
        for name, state in rollout.world.states().items():
            yield STATE.key(team, name), state
        done = rollout.step()
        for name in names:
            out = done.outputs[name]
            yield COMMAND.key(team, name), out.command
            if out.measurement is not None:
                yield MEASUREMENT.key(team, name), out.measurement
            if out.plan is not None:
                yield PLAN.key(team, name), out.plan
        for event in done.events:
            yield EVENT.key(team), event


class _CoarseWorld(World):
    """A world whose robots have sensors of some 16 bit."""

    def states(self) -> dict[str, State]:
        return {name: _coarse(state) for name, state in super().states().items()}


def _coarse(state: State) -> State:
    values: dict[str, Any] = {
        name: np.round(getattr(state, name) / step) * step for name, step in _RESOLUTION.items()
    }
    # As it comes off the wire: compiled functions tell arrays that cannot be written from others.
    return decode(encode(replace(state, **values)), State)
