"""From what was heard of a team to a picture of it."""

from __future__ import annotations

from typing import Final

import numpy as np

from quadriga.recordings.dead_reckoning import follow_speeds
from quadriga.recordings.truth import yaw_of
from quadriga.shared.messages import Plan
from quadriga.shared.robots.conventions import N_LEGS, N_OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS
from quadriga.view.picture import Picture
from quadriga.view.placement import quat_of
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
    n, samples = shape.count, shape.config.planner.N
    outputs, rise = np.zeros((n, samples, N_OUTPUTS)), np.zeros((n, samples))
    for i, name in enumerate(shape.robots):
        plan = snapshot.plans.get(name)
        if plan is None:
            continue
        rows = plan.y[sample_at(plan, snapshot.tick) :][:samples]
        if len(rows):
            outputs[i, : len(rows)] = rows
            rise[i, : len(rows)] = rows[:, 0] - rows[0, 0]
            rise[i, len(rows) :] = rise[i, len(rows) - 1]
    # What a plan is shorter is zeros: there its robot goes no farther.
    way = follow_speeds(np.stack([trunk[:, 0], trunk[:, 1], yaw], axis=1), outputs)
    paths = np.repeat(trunk[:, None, :3], samples + 1, axis=1)
    paths[:, 1:, :2] = way[..., :2]
    paths[:, 1:, 2] += rise
    return paths


def sample_at(plan: Plan, tick: int) -> int:
    """Which sample of a plan is in force at a tick; the number of samples, if none is any more."""
    return min(max(tick - plan.tick, 0) // SAMPLE_MS, len(plan.y))
