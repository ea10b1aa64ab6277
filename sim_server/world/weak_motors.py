"""Motors that weaken: which, when and by how much."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robot.conventions import JOINT_NAMES, robot_names

_KEY: Final = "world.weak_motor"
_GRAMMAR: Final = "'robot:joint:start[s]', commas between motors"
_ANY: Final = "any"
_JOINTS: Final = tuple(name.removesuffix("_joint") for name in JOINT_NAMES)
_LATEST: Final = 3600.0  # s


@dataclass(frozen=True, slots=True)
class WeakMotor:
    """A motor that gives only `share` of its torque from tick `start` on.

    Attributes:
        robot: its index.
        joint: its index in `JOINT_NAMES`.
        start: tick, ms.
        share: of the torque that a sound motor would give.
    """

    robot: int
    joint: int
    start: int
    share: float

    @property
    def detail(self) -> str:
        """Detail of the event that announces the weakening."""
        return f"{_JOINTS[self.joint]} gives {100 * self.share:g} % of its torque"


def weak_motors(config: Config, random: np.random.Generator) -> tuple[WeakMotor, ...]:
    """The motors that `world.weak_motor` describes, in the order written.

    Raises:
        ConfigError: the text does not follow the grammar, or names no such robot or joint.
    """
    text, names = config.world.weak_motor, robot_names(config.team.robots)
    if not text:
        return ()
    share = config.world.weak_share
    return tuple(_parse(part.strip(), names, share, random) for part in text.split(","))


def _parse(
    part: str, names: tuple[str, ...], share: float, random: np.random.Generator
) -> WeakMotor:
    fields = [word.strip() for word in part.split(":")]
    if len(fields) != 3:
        raise ConfigError(_KEY, repr(part), _GRAMMAR)
    robots = [i for i, name in enumerate(names) if fields[0] in (name, _ANY)]
    joints = [i for i, name in enumerate(_JOINTS) if fields[1] in (name, *name.split("_"), _ANY)]
    if not robots:
        raise ConfigError(_KEY, f"robot {fields[0]!r}", f"'any' or one of {', '.join(names)}")
    if not joints:
        raise ConfigError(
            _KEY,
            f"joint {fields[1]!r}",
            f"'any', a part, a leg or {_JOINTS[0]}",
            "parts are hip, thigh, calf; legs are FL, FR, RL, RR",
        )
    try:
        start = float(fields[2])
    except ValueError:
        start = math.nan
    if not 0.0 <= start <= _LATEST:
        raise ConfigError(_KEY, f"start {fields[2]!r} in {part!r}", f"0 … {_LATEST:g} s")
    return WeakMotor(
        robot=int(random.choice(robots)),
        joint=int(random.choice(joints)),
        start=round(1000 * start),
        share=share,
    )
