"""A robot that stands, as its reports tell it, and what the feet of a real one say."""

from __future__ import annotations

import gzip
import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.unitree.packets import SERVO, Battery, MotorTargets, RobotReport

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def config_of(robot: str = "a1", **bridge: Any) -> Config:
    """The default limits for a robot of a kind, but for keys of the section `bridge`."""
    return load(overrides={"team.robot": robot, **{f"bridge.{k}": v for k, v in bridge.items()}})


def standing(config: Config, **fields: Any) -> RobotReport:
    """The report of a robot that stands still, but for some fields."""
    zero = np.zeros(12)
    report = RobotReport(
        tick=1,
        quat_wxyz=LEVEL,
        gyro=np.zeros(3),
        accel=np.array([0.0, 0.0, GRAVITY]),
        q=config.robot.q_stand.copy(),
        dq=zero,
        tau=zero,
        mode=np.full(12, SERVO, np.uint8),
        temperature=np.full(12, 40.0),
        battery=Battery(80, -5.0, 24.0),
    )
    return replace(report, **fields)


def real_go1_counts() -> Array:
    """Counts of a walking Go1's feet, (3970, 4), in the order sent; 500 rows a second."""
    packed = (Path(__file__).parent / "go1_foot_counts.json.gz").read_bytes()
    return np.array(json.loads(gzip.decompress(packed))["counts"], dtype=np.float64)


def tilted(angle: float) -> Any:
    """An attitude rolled by an angle, rad."""
    return np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])


def pressing(*buttons: str) -> bytes:
    """What the remote control sends while these buttons are down, sticks at rest."""
    bits = sum({"L2": 1 << 5, "B": 1 << 9, "up": 1 << 12}[button] for button in buttons)
    return struct.pack("<2sH36x", b"\x55\x51", bits)


def holding(config: Config, **fields: Any) -> MotorTargets:
    """The command that holds the stand, but for some fields."""
    zero = np.zeros(12)
    targets = MotorTargets(
        np.full(12, SERVO, np.uint8),
        config.robot.q_stand.copy(),
        zero,
        zero,
        np.full(12, 40.0),
        np.full(12, 1.0),
    )
    return replace(targets, **fields)
