"""What an A1 can do at most, with ample room: numbers beyond it are errors, wherever they are from.

Whatever is finite passes the wire, and single precision overflows long before double does: one
such number among the peers' would be infinite in the plan, and so in everything that follows it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.shared.config.sections import PlannerConfig
from quadriga.shared.robot.a1 import GRAVITY, TOTAL_MASS, Array

# N, each component of each foot's: ten times the weight on one foot, several times what the motors
# can press. A planner that is allowed deviations beyond that may tell of them.
FORCE_MAX: Final = 10.0 * TOTAL_MASS * GRAVITY
# m, m/s, rad, rad/s: ten times as fast as the motors turn and swing a leg (21 rad/s, 8 m/s); and
# many times what a robot that falls reaches.
OUTPUT_MAX: Final = 100.0


def plausible(config: PlannerConfig, u: Array, y: Array) -> bool:
    """Whether forces u, (…, 12), N, and outputs y, (…, 6), are numbers that a robot can mean."""
    most = FORCE_MAX + max(config.deviation_max)
    return bool(np.abs(u).max() <= most) and plausible_outputs(y)


def plausible_outputs(y: Array) -> bool:
    """The same of outputs alone."""
    return bool(np.abs(y).max() <= OUTPUT_MAX)  # false for NaN
