"""The height over the stance feet, as the robots measure it, against the world's truth."""

from __future__ import annotations

import numpy as np

from quadriga.identification.rollout import Rollout
from quadriga.shared.config.load import load
from quadriga.team.operator import reference_at
from tests.a1 import FOOT_RADIUS

CONFIG = load(
    None,
    {
        "team.robots": 2,
        "planner.kind": "none",
        # Two definitions are compared: offsets of sensors would be errors of their own, and so is
        # what an estimator makes of offsets that are not there.
        "sensors.preset": "ideal",
        "estimator.tilt_time": 0.0,
        "world.terrain": "boxes",
        "world.terrain_height": 0.08,
        "world.seed": 1600,
    },
)
HEIGHT, FILTER_MS = CONFIG.reference.height, 50.0


def test_errors_of_the_measured_height_are_errors_of_the_true_one() -> None:
    """True: the trunk over the mean of what lies under loaded feet, filtered alike."""
    rollout = Rollout(CONFIG, None, lambda t: reference_at(CONFIG, t) if t % 100 == 0 else None)
    world = rollout.world
    feet = np.array(world._feet).reshape(2, 4)
    level, measured, true = np.zeros(2), [], []
    for tick in rollout.ticks(4000):
        truth = world.truth()
        ground = world.physics.geom_xpos[feet, 2] - FOOT_RADIUS
        loaded = truth.grf[..., 2] > CONFIG.controller.contact_force
        for i in np.flatnonzero(loaded.any(axis=1)):
            level[i] += (ground[i, loaded[i]].mean() - level[i]) / FILTER_MS
        samples = [out.measurement for out in tick.outputs.values()]
        if tick.tick > 1500 and tick.tick % 10 == 0:
            measured.append([sample.y[0] for sample in samples if sample is not None])
            true.append(truth.base_pos[:, 2] - level)
    errors = np.array(measured) - HEIGHT, np.array(true) - HEIGHT
    own, real = (float(np.sqrt(np.mean(error**2))) for error in errors)
    assert own > 0.003, "nothing to be measured"
    assert 0.75 < own / real < 1.25
    for one, other in zip(errors[0].T, errors[1].T, strict=True):
        assert np.corrcoef(one, other)[0, 1] > 0.85
