"""What the low level remembers from tick to tick, as one flat row: a tick costs one copy of it.

Compiled code takes and fills the row; `Memory` names its parts for everyone else.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from quadriga.agents.controller.foot_load import FOOT_LOAD, FOOT_LOAD_SIZE
from quadriga.agents.controller.maths.rows import places, row_size
from quadriga.shared.robots.conventions import N_FORCES, N_LEGS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record


class MemoryLayout(NamedTuple):
    """Where `Memory.flat` keeps what; units, shapes and frames: see the properties of `Memory`."""

    mean: slice
    covariance: slice
    contact: slice
    early_contact: slice
    unloaded: slice
    touchdown_seen: slice
    ground: slice
    swing_start: slice
    foot_goal: slice
    speed_integral: slice
    position_error: slice
    ground_height: int
    half_cycle: int
    height_integral: int
    yaw_des: int
    force_sum: slice
    force_count: int
    lift: slice
    reflex: slice
    reaction: slice
    mu_reduction: int
    load: int
    foot_load: slice
    imu_error: slice
    stood_s: int
    heading_over_feet: int
    drift_mean: int
    yaw_drift: int


MEMORY: Final = MemoryLayout(
    **places(
        mean=6 * 3,
        covariance=6 * 6,
        contact=N_LEGS,
        early_contact=N_LEGS,
        unloaded=N_LEGS,
        touchdown_seen=N_LEGS,
        ground=N_LEGS,
        swing_start=N_LEGS * 3,
        foot_goal=N_LEGS * 3,
        speed_integral=2,
        position_error=2,
        ground_height=1,
        half_cycle=1,
        height_integral=1,
        yaw_des=1,
        force_sum=N_FORCES,
        force_count=1,
        lift=N_LEGS,
        reflex=N_LEGS,
        reaction=N_LEGS * 3,
        mu_reduction=1,
        load=1,
        foot_load=FOOT_LOAD_SIZE,
        imu_error=4,
        stood_s=1,
        heading_over_feet=1,
        drift_mean=1,
        yaw_drift=1,
    )
)
MEMORY_SIZE: Final = row_size(MEMORY)


class FilterState(NamedTuple):
    """What the estimator remembers, in the odometry frame; the axes share one covariance.

    Attributes:
        mean: trunk position, trunk velocity, feet FL FR RL RR, (6, 3), m, m/s.
        covariance: of the six, the same for each axis, (6, 6), m², m²/s².
    """

    mean: Array
    covariance: Array


class FeetMemory(NamedTuple):
    """What is remembered of the feet, see the properties of `Memory`; (4,) each, where not said."""

    contact: Array
    early_contact: Array
    unloaded: Array
    touchdown_seen: Array
    ground: Array
    lift: Array
    reflex: Array
    reaction: Array  # (4, 3)


@compiled
def filter_state_of(flat: Array) -> FilterState:
    """Views of the estimator's mean and covariance."""
    return FilterState(flat[MEMORY.mean].reshape(6, 3), flat[MEMORY.covariance].reshape(6, 6))


@compiled
def feet_memory_of(flat: Array) -> FeetMemory:
    """Views of what is remembered of the feet."""
    return FeetMemory(
        flat[MEMORY.contact],
        flat[MEMORY.early_contact],
        flat[MEMORY.unloaded],
        flat[MEMORY.touchdown_seen],
        flat[MEMORY.ground],
        flat[MEMORY.lift],
        flat[MEMORY.reflex],
        flat[MEMORY.reaction].reshape(4, 3),
    )


@compiled
def swing_start_of(flat: Array) -> Array:
    """View of where swings began, (4, 3), m, odometry frame."""
    return flat[MEMORY.swing_start].reshape(4, 3)


@compiled
def foot_goal_of(flat: Array) -> Array:
    """View of where unloaded stance feet are lowered to, (4, 3), m, odometry frame."""
    return flat[MEMORY.foot_goal].reshape(4, 3)


@record
class Memory:
    """The low level's memory; `flat`, see `MemoryLayout`, is not to be changed."""

    flat: Array

    @property
    def mean(self) -> Array:
        """Trunk position, trunk velocity, feet FL FR RL RR, (6, 3), m, m/s, odometry frame."""
        return self.flat[MEMORY.mean].reshape(6, 3)

    @property
    def covariance(self) -> Array:
        """Of the mean, the same for all axes, (6, 6), m², m²/s²."""
        return self.flat[MEMORY.covariance].reshape(6, 6)

    @property
    def contact(self) -> Array:
        """1 where the QP may push, (4,)."""
        return self.flat[MEMORY.contact]

    @property
    def early_contact(self) -> Array:
        """1 where the foot landed before its stance began, (4,)."""
        return self.flat[MEMORY.early_contact]

    @property
    def unloaded(self) -> Array:
        """Time without force during stance, (4,), s."""
        return self.flat[MEMORY.unloaded]

    @property
    def touchdown_seen(self) -> Array:
        """1 where the foot has borne load in this stance, (4,)."""
        return self.flat[MEMORY.touchdown_seen]

    @property
    def ground(self) -> Array:
        """Height of the ground last measured under each foot, (4,), m, odometry frame."""
        return self.flat[MEMORY.ground]

    @property
    def ground_height(self) -> float:
        """Filtered height of the ground under the stance feet, m, odometry frame."""
        return float(self.flat[MEMORY.ground_height])

    @property
    def half_cycle(self) -> int:
        """Number of the gait's half cycle at the last tick; a new one is a switch."""
        return int(self.flat[MEMORY.half_cycle])

    @property
    def swing_start(self) -> Array:
        """Where each foot left the ground, (4, 3), m, odometry frame."""
        return self.flat[MEMORY.swing_start].reshape(4, 3)

    @property
    def foot_goal(self) -> Array:
        """Where a foot that lost contact is being lowered to, (4, 3), m, odometry frame."""
        return self.flat[MEMORY.foot_goal].reshape(4, 3)

    @property
    def lift(self) -> Array:
        """Progress of the half cycle at which each foot's swing began; −1: not yet. (4,)."""
        return self.flat[MEMORY.lift]

    @property
    def reflex(self) -> Array:
        """Time for which each swing foot will still back off from what stopped it, (4,), s."""
        return self.flat[MEMORY.reflex]

    @property
    def reaction(self) -> Array:
        """What stops each foot off the ground, (4, 3), m/s², odometry frame.

        The negative of the acceleration that was to bring it back to its reference.
        """
        return self.flat[MEMORY.reaction].reshape(4, 3)

    @property
    def mu_reduction(self) -> float:
        """What is taken off the friction coefficient of the QP because feet slid."""
        return float(self.flat[MEMORY.mu_reduction])

    @property
    def load(self) -> float:
        """Estimate of what the robot carries, kg."""
        return float(self.flat[MEMORY.load])

    @property
    def imu_error(self) -> Array:
        """Estimated error of the acceleration that the IMU tells, (3,), m/s², trunk frame."""
        return self.flat[MEMORY.imu_error][:3]

    @property
    def ground_force(self) -> Array:
        """Force of the ground on each foot by the joints' torques, (4, 3), N, odometry frame."""
        return self.flat[MEMORY.foot_load][FOOT_LOAD.force].reshape(4, 3)

    @property
    def height_integral(self) -> float:
        """Integral of the height error, m·s."""
        return float(self.flat[MEMORY.height_integral])

    @property
    def speed_integral(self) -> Array:
        """Leaking integral of the speed error, (2,), m, yaw frame."""
        return self.flat[MEMORY.speed_integral]

    @property
    def position_error(self) -> Array:
        """Limited position error, the integral of the speed error, (2,), m, yaw frame."""
        return self.flat[MEMORY.position_error]

    @property
    def yaw_des(self) -> float:
        """Desired heading, rad."""
        return float(self.flat[MEMORY.yaw_des])

    @property
    def stood_s(self) -> float:
        """For how long all feet have stood, as they are meant to, s."""
        return float(self.flat[MEMORY.stood_s])

    @property
    def heading_over_feet(self) -> float:
        """Desired heading less that of the feet, once it has stood for long, rad."""
        return float(self.flat[MEMORY.heading_over_feet])

    @property
    def drift_mean(self) -> float:
        """Mean rate at which the feet have seemed to turn in the present stand, rad/s."""
        return float(self.flat[MEMORY.drift_mean])

    @property
    def yaw_drift(self) -> float:
        """Drift of the IMU's yaw by the last long stand, rad/s; 0 before the first."""
        return float(self.flat[MEMORY.yaw_drift])

    @property
    def mean_force(self) -> Array:
        """Mean of the planned forces so far in the present sample, (12,), N, yaw frame."""
        mean: Array = self.flat[MEMORY.force_sum] / max(1.0, self.flat[MEMORY.force_count])
        return mean


def initial_memory() -> Array:
    """`Memory.flat` of a robot that stands on flat ground at height zero; all else is zero."""
    flat = np.zeros(MEMORY_SIZE)
    flat[MEMORY.contact] = flat[MEMORY.touchdown_seen] = 1.0
    flat[MEMORY.half_cycle] = -1.0
    return flat
