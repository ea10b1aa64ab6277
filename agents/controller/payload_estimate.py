"""How much a robot carries that its model does not know of, from what its feet bear."""

from __future__ import annotations

import numpy as np

from quadriga.agents.controller.maths.links import LINK
from quadriga.shared.robots.conventions import GRAVITY, Array
from quadriga.shared.runtime.jit import compiled

_MOST = 25.0  # kg; two robots' weight is no load that legs carry
_HEIGHT = 0.08  # m, of a load's centre above the trunk's origin


@compiled
def estimate_load(load0: float, foot_load: Array, mass: float, rate: float) -> float:
    """The load, kg, filtered: on average the feet bear the weight of robot and load.

    What yokes pull up or down counts as load. Robots that are lifted carry nothing.

    Args:
        load0: at the last tick, kg.
        foot_load: vertical forces of the ground on the feet, (4,), N.
        mass: of the robot alone, kg.
        rate: share of a tick in the filter.
    """
    surplus = np.sum(foot_load) / GRAVITY - mass
    return min(_MOST, max(0.0, load0 + rate * (surplus - load0)))


@compiled
def add_load(links: Array, load: float) -> Array:
    """The rows of `link_table` with a load, kg, on the middle of the trunk's top.

    Two bodies that move as one: the centre is the mean, and about it I = I₁ + I₂ +
    m₁ m₂ / (m₁ + m₂) (|d|² 1 − d dᵀ); the load is taken for a point.
    """
    rows = links.copy()
    trunk = rows[0]
    com, moments, bare = trunk[LINK.com], trunk[LINK.moments], trunk[LINK.mass]
    mass = bare + load
    x, y, z = -com[0], -com[1], _HEIGHT - com[2]
    share, reduced = load / mass, bare * load / mass
    trunk[LINK.mass] = mass
    com[0] += share * x
    com[1] += share * y
    com[2] += share * z
    moments[0] += reduced * (y * y + z * z)
    moments[1] -= reduced * x * y
    moments[2] -= reduced * x * z
    moments[3] += reduced * (x * x + z * z)
    moments[4] -= reduced * y * z
    moments[5] += reduced * (x * x + y * y)
    return rows
