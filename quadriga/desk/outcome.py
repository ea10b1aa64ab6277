"""What came of a walk on the desk: from the robots' own words, and from the truth on them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from quadriga.desk.robots import Said
from quadriga.shared.messages import Truth
from quadriga.shared.robots.conventions import Array
from quadriga.sim_server.emulator.process import LOST

FELL: Final = 0.8  # rad, tilt of a trunk: a robot that lies down or sinks stays flatter
_SECOND: Final = 1000  # ms
_AT_REST: Final = ("motors damped", "motors off")


@dataclass(frozen=True, slots=True)
class TrunkTrace:
    """A trunk over the simulated robots' own time, from their file of truth.

    Attributes:
        ms: (T,).
        xyz: m, (T, 3).
        rpy: rad, (T, 3).
        velocity: forward and lateral, m/s, (T, 2), and the yaw rate, rad/s: (T, 3).
    """

    ms: Array
    xyz: Array
    rpy: Array
    velocity: Array

    def tilt(self, begin: float, end: float = float("inf")) -> float:
        """Greatest tilt from `begin` to `end`, ms; rad."""
        now = (self.ms >= begin) & (self.ms <= end)
        roll, pitch = self.rpy[now, 0], self.rpy[now, 1]
        return float(np.arccos(np.clip(np.cos(roll) * np.cos(pitch), -1, 1)).max(initial=0.0))


def read_truth(path: Path, names: Sequence[str]) -> dict[str, TrunkTrace]:
    """The trunks of the robots with these names.

    Args:
        path: written by `quadriga sim --as KIND --truth`: columns `ms` and `<robot>_…`.
        names: of the robots.
    """
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}

    def stack(name: str, *fields: str) -> Array:
        return np.stack([columns[f"{name}_{field}"] for field in fields], axis=-1)

    return {
        name: _trace(
            columns["ms"],
            stack(name, "x", "y", "z"),
            stack(name, "qw", "qx", "qy", "qz"),
            stack(name, "vx", "vy", "vz"),
            columns[f"{name}_wz"],
        )
        for name in names
    }


def traces_of(truths: Sequence[Truth]) -> list[TrunkTrace]:
    """The trunks of a recorded walk by its truth, robot by robot."""
    ms = np.array([float(truth.tick) for truth in truths])
    return [
        _trace(
            ms,
            np.array([truth.base_pos[k] for truth in truths]),
            np.array([truth.base_quat_wxyz[k] for truth in truths]),
            np.array([truth.base_vel[k] for truth in truths]),
            np.array([truth.base_omega[k, 2] for truth in truths]),
        )
        for k in range(len(truths[0].robots))
    ]


def _trace(ms: Array, xyz: Array, quat_wxyz: Array, velocity: Array, yaw_rate: Array) -> TrunkTrace:
    w, x, y, z = quat_wxyz.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    cos, sin, (vx, vy) = np.cos(yaw), np.sin(yaw), velocity[:, :2].T
    forward = np.stack([cos * vx + sin * vy, cos * vy - sin * vx, yaw_rate], axis=-1)
    return TrunkTrace(ms, xyz, np.stack([roll, pitch, yaw], axis=-1), forward)


def time_to_rest(said: Sequence[Said], robot: str, since: int) -> int | None:
    """From `since` until a robot's motors were damped or off for the first time; ms."""
    for line in said:
        if line.ms >= since and line.text in {f"{robot} {state}" for state in _AT_REST}:
            return line.ms - since
    return None


def time_kept(said: Sequence[Said], begin: int, end: int) -> float:
    """Share of real time that the simulated robots kept, 0 … 1; a real one always keeps it.

    Args:
        said: by their process.
        begin: of the walk, their ms.
        end: of it, their ms.
    """
    until = end + _SECOND  # a second's loss is told at its end
    lines = (line.text for line in said if begin < line.ms <= until and line.text.endswith(LOST))
    lost = sum(int(text.split()[0]) for text in lines)
    return round((end - begin) / max(end - begin + lost, 1), 4)


def describe_walk(trace: TrunkTrace, begin: float, end: float) -> Mapping[str, Any]:
    """Figures of the steady part of a walk.

    Args:
        trace: of one trunk.
        begin: of the steady part, ms.
        end: of it, ms.
    """
    now = (trace.ms >= begin) & (trace.ms <= end)
    if now.sum() < 2:
        return {}
    way = np.diff(trace.xyz[now][:, :2], axis=0)
    return {
        "vx": float(trace.velocity[now, 0].mean()),
        "vy_rms": _rms(trace.velocity[now, 1]),
        "wz_rms": _rms(trace.velocity[now, 2]),
        "roll_rms": _rms(trace.rpy[now, 0]),
        "pitch_rms": _rms(trace.rpy[now, 1]),
        "distance": float(np.linalg.norm(way, axis=1).sum()),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
