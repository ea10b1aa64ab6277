"""The pulses whose response is measured: their directions, and where in the gait they begin."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import scheduled_stance, step_ms, walking_steps
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_LEGS, Array

# Two feet on a diagonal can give a force along each axis, a moment about the other diagonal and
# one about the vertical. A moment about their own diagonal they cannot give.
DIRECTIONS: Final = ("fx", "fy", "fz", "tilt", "turn")
DIRECTIONS_TEXT: Final = (
    "fx, fy, fz: the same force at each stance foot, along an axis of the yaw frame; tilt: upwards "
    "at the front, downwards at the hind stance foot; turn: about the vertical"
)
FORCE: Final = 20.0  # N at each stance foot
PULSE_MS: Final = 20
MOST_PHASES: Final = 10
_SETTLING_MS: Final = 1500  # from full speed to the first pulse


def pulse_starts(config: Config) -> NDArray[np.int64]:
    """Ticks at which pulses begin: planning steps spread over one cycle of gait and plans.

    The team has reached its full speed by then. At most `MOST_PHASES`, in order.
    """
    cycle, step = walking_steps(config), step_ms(config)
    ready = config.gait.stand_ms + round(1000 * config.reference.ramp) + _SETTLING_MS
    first = -(-ready // step)
    first += (cycle.start - first) % len(cycle)  # a step that does what the first of a walk does
    every = -(-len(cycle) // MOST_PHASES)
    return step * np.arange(first, first + len(cycle), every, dtype=np.int64)


def pulse_forces(config: Config, robot: int, tick: int) -> Array:
    """The force deviation of each direction, for a pulse of a robot that begins at `tick`.

    Args:
        config: the team's configuration.
        robot: its index.
        tick: of a robot that walks; its scheduled stance feet bear the pulse.

    Returns:
        Shape (5, 12), N, yaw frame; zero at feet that swing.
    """
    stance = scheduled_stance(config, robot, np.array([tick]))[0]
    feet = np.array(config.robot.feet_under_hips)[:, :2]
    arm = feet - feet[stance].mean(axis=0)
    across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    forces = np.zeros((len(DIRECTIONS), N_LEGS, 3))
    forces[0, :, 0] = forces[1, :, 1] = forces[2, :, 2] = 1.0
    forces[3, :, 2] = np.sign(arm[:, 0])
    forces[4, :, :2] = across / np.linalg.norm(across, axis=1, keepdims=True)
    forces[:, ~stance] = 0.0
    return FORCE * forces.reshape(len(DIRECTIONS), -1)
