"""The simulator's word on the team as arrays, with the outputs the planner is judged by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Truth
from quadriga.shared.robots.conventions import Array
from quadriga.shared.robots.spec import RobotSpec
from quadriga.sim_server.terrain.terrain import Terrain
from quadriga.sim_server.world.team_model import build_terrain

Ticks = NDArray[np.int64]
_FALL_TILT: Final = 1.0  # rad
_FALL_HEIGHT: Final = 0.12  # m above the terrain
_RISEN: Final = 0.06  # m, above that height a robot is up again that was down


@dataclass(frozen=True, slots=True)
class TruthTrace:
    """The simulator's word on the trunks, T samples of n robots and k yokes.

    Attributes:
        tick: shape (T,), ms.
        base_pos, base_vel: world frame, shape (T, n, 3), m and m/s.
        base_quat_wxyz: trunk to world, shape (T, n, 4).
        grf: ground on foot, world frame, shape (T, n, 4, 3), N.
        yoke_error: shape (T, k), m.
        yoke_force: shape (T, k), N, positive when the yoke pushes its robots apart.
        y: the planner's outputs z, vx, vy, roll, pitch, wz, shape (T, n, 6); z is the trunk's
            height above the mean terrain under its feet's places, velocities are in the yaw frame.
        tilt: angle between the trunk's z axis and the vertical, shape (T, n), rad.
    """

    tick: Ticks
    base_pos: Array
    base_vel: Array
    base_quat_wxyz: Array
    grf: Array
    yoke_error: Array
    yoke_force: Array
    y: Array
    tilt: Array

    @property
    def tilted(self) -> NDArray[np.bool_]:
        """Whether a robot lies on its side or its back, shape (T, n)."""
        return self.tilt > _FALL_TILT

    @property
    def low(self) -> NDArray[np.bool_]:
        """Whether a robot's trunk is on the ground, however it is turned, shape (T, n)."""
        return self.y[..., 0] < _FALL_HEIGHT

    @property
    def down(self) -> NDArray[np.bool_]:
        """Whether a robot lies on the ground, shape (T, n)."""
        return self.tilted | self.low

    @property
    def up(self) -> NDArray[np.bool_]:
        """Whether a robot surely stands, shape (T, n)."""
        return ~self.tilted & (self.y[..., 0] >= _FALL_HEIGHT + _RISEN)


def build_truth_trace(messages: Sequence[Truth], config: Config) -> TruthTrace:
    """Stack the truth messages of a run of `config`."""
    n = config.team.robots
    pos, vel = stack(messages, "base_pos", n, 3), stack(messages, "base_vel", n, 3)
    quat = stack(messages, "base_quat_wxyz", n, 4)
    terrain = build_terrain(config)
    y = true_outputs((pos, quat), (vel, stack(messages, "base_omega", n, 3)), terrain, config.robot)
    return TruthTrace(
        tick=ticks_of(messages),
        base_pos=pos,
        base_vel=vel,
        base_quat_wxyz=quat,
        grf=stack(messages, "grf", n, 4, 3),
        yoke_error=stack(messages, "yoke_error", 0),
        yoke_force=stack(messages, "yoke_force", 0),
        y=y,
        tilt=np.arccos(np.clip(np.cos(y[..., 3]) * np.cos(y[..., 4]), -1.0, 1.0)),
    )


def true_outputs(
    pose: tuple[Array, Array], motion: tuple[Array, Array], terrain: Terrain, robot: RobotSpec
) -> Array:
    """The planner's outputs z, vx, vy, roll, pitch, wz of trunks.

    Args:
        pose: positions (…, 3), m, and quaternions wxyz (…, 4), trunk to world.
        motion: velocities (…, 3), m/s, and angular velocities (…, 3), rad/s, world frame.
        terrain: the ground, over which z is.
        robot: their kind.

    Returns:
        Shape (…, 6).
    """
    (pos, quat), (vel, omega) = pose, motion
    w, x, y, z = np.moveaxis(quat, -1, 0)
    yaw = yaw_of(quat)
    cos, sin = np.cos(yaw), np.sin(yaw)
    ground = terrain.height_under_hips(pos[..., 0], pos[..., 1], yaw, robot.feet_under_hips)
    outputs = [
        pos[..., 2] - ground,
        cos * vel[..., 0] + sin * vel[..., 1],
        cos * vel[..., 1] - sin * vel[..., 0],
        np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0)),
        omega[..., 2],
    ]
    return np.stack(outputs, axis=-1)


def distance(truth: TruthTrace, stride_ms: int, before: int | None = None) -> float | None:
    """Length of the trunks' ways, mean over the robots, m; None without a sample.

    Sampled once a stride, so that sway within it does not count; up to the tick `before`, if any.
    """
    count = len(truth.tick) if before is None else int(np.searchsorted(truth.tick, before))
    tick, pos = truth.tick[:count], truth.base_pos[:count]
    if not count:
        return None
    way = np.concatenate([pos[tick % stride_ms == 0], pos[-1:]])[..., :2]
    return float(np.linalg.norm(np.diff(way, axis=0), axis=-1).sum(axis=0).mean())


def yaw_of(quat_wxyz: Array) -> Array:
    """Yaw of R = R_z(yaw) R_y(pitch) R_x(roll). Shape (...,), rad."""
    w, x, y, z = np.moveaxis(quat_wxyz, -1, 0)
    yaw: Array = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return yaw


def stack(messages: Sequence[Any], field: str, *shape: int) -> Array:
    """A field of messages along a new first axis; `shape` is that of one, for no message."""
    if not messages:
        return np.zeros((0, *shape))
    return np.stack([getattr(message, field) for message in messages])


def ticks_of(messages: Sequence[Any]) -> Ticks:
    """Ticks of messages. Shape (len(messages),), ms."""
    return np.array([message.tick for message in messages], dtype=np.int64)
