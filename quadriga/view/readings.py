"""What a snapshot says in figures and words, beside what is drawn."""

from __future__ import annotations

import numpy as np

from quadriga.recordings.truth import true_outputs
from quadriga.shared.messages import Reference, Status
from quadriga.shared.robots.conventions import N_OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS
from quadriga.view.compose import sample_at
from quadriga.view.picture import RobotAccount, TeamOutputs
from quadriga.view.snapshot import Snapshot
from quadriga.view.team_shape import TeamShape


def read_outputs(shape: TeamShape, snapshot: Snapshot) -> TeamOutputs:
    """What is planned, measured, true and asked for at an instant."""
    n = shape.count
    measured, planned, true = np.full((3, n, N_OUTPUTS), np.nan)
    for i, name in enumerate(shape.robots):
        if (sample := snapshot.measurements.get(name)) is not None:
            measured[i] = sample.y
        if (plan := snapshot.plans.get(name)) is not None:
            k = sample_at(plan, snapshot.tick)
            if k < len(plan.y):
                planned[i] = plan.y[k]
    if (truth := snapshot.truth) is not None:
        pose = truth.base_pos, truth.base_quat_wxyz
        motion = truth.base_vel, truth.base_omega
        true = true_outputs(pose, motion, shape.terrain, shape.config.robot)
    return TeamOutputs(measured, planned, true, _asked_outputs(snapshot.reference))


def _asked_outputs(reference: Reference | None) -> Array:
    if reference is None:
        return np.full(N_OUTPUTS, np.nan)
    return np.array([reference.height, reference.vx, reference.vy, 0.0, 0.0, reference.wz])


def read_accounts(shape: TeamShape, snapshot: Snapshot) -> tuple[RobotAccount, ...]:
    """What is known of each robot's mind."""
    return tuple(_account(shape, snapshot, name) for name in shape.robots)


def _account(shape: TeamShape, snapshot: Snapshot, name: str) -> RobotAccount:
    status, plan = snapshot.statuses.get(name), snapshot.plans.get(name)
    mode, reason, estimator = "", "", ""
    if status is not None:
        mode, reason, estimator = status.mode, status.reason, status.estimator
    if plan is None:
        return RobotAccount(mode, reason, planner_ms=_slowest(status), estimator=estimator)
    step_ms = SAMPLE_MS * shape.config.planner.applied
    return RobotAccount(
        mode=mode,
        reason=reason,
        plan=plan.status,
        plan_age_ms=max(snapshot.tick - plan.tick, 0),
        peer_ages_ms={peer: step_ms * (plan.step - step) for peer, step in plan.used.items()},
        planner_ms=_slowest(status),
        estimator=estimator,
    )


def _slowest(status: Status | None) -> float | None:
    """The longest planning step that a status tells of, ms."""
    if status is None or not status.planner_ms.size:
        return None
    return float(status.planner_ms.max())
