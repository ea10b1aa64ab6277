"""From what was heard of a team to a picture of it."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.recordings.truth import true_outputs, yaw_of
from quadriga.shared.robot.conventions import N_LEGS, N_OUTPUTS, Array
from quadriga.shared.wire.messages import Plan, Reference, Status
from quadriga.shared.wire.topics import SAMPLE_MS
from quadriga.view.picture import Account, Picture, TeamOutputs
from quadriga.view.placement import follow_speeds, quat_of
from quadriga.view.skeleton import rotate
from quadriga.view.snapshot import Snapshot
from quadriga.view.team_shape import TeamShape

_LOADED: Final = 2.0  # N; a foot that bears more stands on the ground


def compose(shape: TeamShape, snapshot: Snapshot) -> Picture:
    """The picture of what was heard; robots that were not heard stand at their place."""
    trunk, is_truth = _place_trunks(shape, snapshot)
    stand, n = shape.config.robot.q_stand, shape.count
    states = [snapshot.states.get(name) for name in shape.robots]
    q_joint = np.array([stand if state is None else state.q_joint for state in states])
    links = shape.skeleton.pose(trunk, q_joint)
    yaw = yaw_of(trunk[:, 3:])
    planned = np.zeros((n, N_LEGS, 3))
    contact = np.ones((n, N_LEGS), dtype=bool)
    for i, name in enumerate(shape.robots):
        if (sample := snapshot.measurements.get(name)) is not None:
            planned[i] = _turn(yaw[i], sample.u.reshape(N_LEGS, 3))
            contact[i] = sample.stance > 0.5
    true = np.zeros_like(planned)
    if snapshot.truth is not None:
        true[:] = snapshot.truth.grf
        contact = np.linalg.norm(true, axis=-1) > _LOADED
    return Picture(
        tick=snapshot.tick,
        robots=shape.robots,
        is_truth=is_truth,
        known=np.array([state is not None for state in states]) | is_truth,
        trunk=trunk,
        link_positions=links.positions,
        link_quats=links.quats,
        feet=links.positions[:, shape.skeleton.feet],
        contact=contact,
        planned_forces=planned,
        true_forces=true,
        paths=_predict_paths(shape, snapshot, trunk, yaw),
        anchors=trunk[:, :3] + rotate(trunk[:, 3:], np.array(shape.config.robot.yoke)),
        outputs=_outputs(shape, snapshot),
        accounts=tuple(_account(shape, snapshot, name) for name in shape.robots),
    )


def _place_trunks(shape: TeamShape, snapshot: Snapshot) -> tuple[Array, bool]:
    """Poses of the trunks, shape (n, 7), and whether they are the truth."""
    trunk = shape.spawn.copy()
    if snapshot.truth is not None:
        trunk[:, :3], trunk[:, 3:] = snapshot.truth.base_pos, snapshot.truth.base_quat_wxyz
        return trunk, True
    for i, name in enumerate(shape.robots):
        place, sample = snapshot.places.get(name), snapshot.measurements.get(name)
        if place is not None and sample is not None:
            trunk[i, :3] = place.x, place.y, sample.y[0]
            trunk[i, 3:] = quat_of(sample.y[3], sample.y[4], np.array(place.yaw))
    return trunk, False


def _turn(yaw: float, forces: Array) -> Array:
    """Forces of the yaw frame in the world frame. Shape (4, 3)."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y, z = forces.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)


def _predict_paths(shape: TeamShape, snapshot: Snapshot, trunk: Array, yaw: Array) -> Array:
    """What is left of each plan's way, from where its robot is now. Shape (n, N + 1, 3)."""
    points = shape.config.planner.N + 1
    paths = np.repeat(trunk[:, None, :3], points, axis=1)
    for i, name in enumerate(shape.robots):
        plan = snapshot.plans.get(name)
        if plan is None:
            continue
        rows = plan.y[_sample_at(plan, snapshot.tick) :][: points - 1]
        if not len(rows):
            continue
        way = follow_speeds(np.array([*trunk[i, :2], yaw[i]]), rows)
        count = 1 + len(rows)
        paths[i, 1:count, :2] = way[:, :2]
        paths[i, 1:count, 2] += rows[:, 0] - rows[0, 0]
        paths[i, count:] = paths[i, count - 1]
    return paths


def _sample_at(plan: Plan, tick: int) -> int:
    """Which sample of a plan is in force at a tick; the number of samples, if none is any more."""
    return min(max(tick - plan.tick, 0) // SAMPLE_MS, len(plan.y))


def _outputs(shape: TeamShape, snapshot: Snapshot) -> TeamOutputs:
    n = shape.count
    measured, planned, true = np.full((3, n, N_OUTPUTS), np.nan)
    for i, name in enumerate(shape.robots):
        if (sample := snapshot.measurements.get(name)) is not None:
            measured[i] = sample.y
        if (plan := snapshot.plans.get(name)) is not None:
            k = _sample_at(plan, snapshot.tick)
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


def _account(shape: TeamShape, snapshot: Snapshot, name: str) -> Account:
    status, plan = snapshot.statuses.get(name), snapshot.plans.get(name)
    mode, reason, estimator = "", "", ""
    if status is not None:
        mode, reason, estimator = status.mode, status.reason, status.estimator
    if plan is None:
        return Account(mode, reason, planner_ms=_slowest(status), estimator=estimator)
    step_ms = SAMPLE_MS * shape.config.planner.applied
    return Account(
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
