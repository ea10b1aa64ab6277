"""Pulses push where they say, at stance feet alone, in every phase of the gait."""

from __future__ import annotations

import numpy as np
import pytest

from quadriga.agents.gait import phase_of, scheduled_stance, step_ms
from quadriga.experiments.probe.pulses import (
    DIRECTIONS,
    FORCE,
    MOST_PHASES,
    pulse_forces,
    pulse_starts,
)
from quadriga.shared.config.load import load

CONFIG = load(None, {"team.robots": 2})


@pytest.mark.parametrize("robot", [0, 1])
@pytest.mark.parametrize("tick", pulse_starts(CONFIG).tolist())
def test_a_pulse_is_a_pure_force_or_a_pure_couple_at_the_stance_feet(robot: int, tick: int) -> None:
    stance = scheduled_stance(CONFIG, robot, np.array([tick]))[0]
    feet = np.column_stack([CONFIG.robot.feet_under_hips, np.zeros(4)])
    forces = pulse_forces(CONFIG, robot, tick).reshape(len(DIRECTIONS), 4, 3)
    assert (forces[:, ~stance] == 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(forces[:, stance], axis=-1), FORCE)
    centre = feet[stance].mean(axis=0)
    moment = np.cross(feet - centre, forces).sum(axis=1)
    np.testing.assert_allclose(forces[:3].sum(axis=1), 2.0 * FORCE * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(moment[:3], 0.0, atol=1e-12)
    np.testing.assert_allclose(forces[3:].sum(axis=1), 0.0, atol=1e-12)
    arm = np.linalg.norm(feet[stance] - centre, axis=1).sum()
    np.testing.assert_allclose(np.linalg.norm(moment[3:], axis=1), FORCE * arm)
    np.testing.assert_allclose(moment[3, 2], 0.0, atol=1e-12)
    assert moment[3, 1] < 0.0, "the front goes up"
    np.testing.assert_allclose(moment[4, :2], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("applied", "stance_ms", "count"), [(4, 200, 10), (1, 200, 10), (4, 150, 8), (8, 200, 5)]
)
def test_pulses_begin_at_planning_steps_in_every_part_of_the_gait(
    applied: int, stance_ms: int, count: int
) -> None:
    config = load(None, {"planner.applied": applied, "gait.stance_ms": stance_ms})
    starts = pulse_starts(config)
    assert len(starts) == count <= MOST_PHASES
    assert (starts % step_ms(config) == 0).all()
    assert (np.diff(starts) > 0).all()
    assert starts[0] >= config.gait.stand_ms + 1000 * config.reference.ramp
    phases = {phase_of(config, int(start) // step_ms(config), 5) for start in starts}
    assert phases == set(range(5))
