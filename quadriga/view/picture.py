"""What a picture of a team shows: everything about one instant, ready to be drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.robots.conventions import Array


@dataclass(frozen=True, slots=True)
class RobotAccount:
    """What is known of a robot's mind.

    Attributes:
        mode: stand, walk, stopping, damping or estop; empty if it has not said so yet.
        reason: why it does not walk, or empty.
        plan: status of its newest plan; empty without one.
        plan_age_ms: how long ago that begins; None without one.
        peer_ages_ms: how much older the plans of others are that went into it, by robot.
        planner_ms: wall time of its slowest planning step since the status before, ms; None if
            it made none.
        estimator: kalman or truth; empty if it has not said so yet.
    """

    mode: str = ""
    reason: str = ""
    plan: str = ""
    plan_age_ms: int | None = None
    peer_ages_ms: Mapping[str, int] | None = None
    planner_ms: float | None = None
    estimator: str = ""


@dataclass(frozen=True, slots=True)
class TeamOutputs:
    """The planner's outputs z, vx, vy, roll, pitch, wz of n robots; NaN where one is not known.

    Attributes:
        measured: what robots measure, shape (n, 6).
        planned: what plans in force have for this instant, shape (n, 6).
        true: what the simulator knows, shape (n, 6).
        asked: what the operator asks for, shape (6,).
    """

    measured: Array
    planned: Array
    true: Array
    asked: Array


@dataclass(frozen=True, slots=True)
class Picture:
    """A team of n robots with L links each at one instant. World frame, m and N.

    Attributes:
        tick: world time, ms.
        robots: their names.
        is_truth: whether trunks are where the simulator says, not where robots believe.
        known: which robots have been heard of at all; others stand at their place, shape (n,).
        trunk: position and quaternion wxyz of each, shape (n, 7).
        link_positions, link_quats: in the order of `Skeleton.links`, shapes (n, L, 3), (n, L, 4).
        feet: shape (n, 4, 3).
        contact: whether a foot is on the ground, shape (n, 4): by its force if that is known, else
            by the gait's schedule.
        planned_forces: of the ground on the feet by the plans, shape (n, 4, 3).
        true_forces: the same by the simulator, shape (n, 4, 3); zero if nobody knows.
        paths: where the trunks go by their plans, shape (n, P, 3); P is always the same, and what
            a path is shorter its last point repeats.
        anchors: the yokes' ball joints, shape (n, 3).
    """

    tick: int
    robots: tuple[str, ...]
    is_truth: bool
    known: NDArray[np.bool_]
    trunk: Array
    link_positions: Array
    link_quats: Array
    feet: Array
    contact: NDArray[np.bool_]
    planned_forces: Array
    true_forces: Array
    paths: Array
    anchors: Array

    @property
    def centre(self) -> Array:
        """Mean position of the trunks, shape (3,), m."""
        centre: Array = self.trunk[:, :3].mean(axis=0)
        return centre
