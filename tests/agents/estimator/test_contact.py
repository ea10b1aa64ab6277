"""Contacts and ground heights from schedule and foot force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quadriga.agents.estimator.contact import update_contacts
from quadriga.shared.robots.conventions import Array
from tests.a1 import FOOT_RADIUS
from tests.agents.estimator.poses import DT, GAINS, blank, gains_of

LOAD = 50.0
ALL, PAIR = np.ones(4), np.array([1.0, 0.0, 0.0, 1.0])
OTHER = 1.0 - PAIR
RETRACTION_MS = round(float(GAINS.reflex_ms))


class Feet:
    """Four feet, each on ground of height zero with its load, stepped through the detector."""

    def __init__(self, **controller: Any) -> None:
        self.gains, self.state = gains_of(**controller), blank()
        self.state.contact = self.state.touchdown_seen = 1.0
        self.force, self.z = np.full(4, LOAD), np.full(4, FOOT_RADIUS)

    def run(self, ticks: int, stance: Array, progress: float, half_cycle: int) -> Any:
        state = self.state
        state.stance, state.progress, state.p_foot[:, 2] = stance, progress, self.z
        state.foot_loaded = self.force >= self.gains.contact_force
        for _ in range(ticks):
            state.switched, state.half_cycle = state.half_cycle != half_cycle, half_cycle
            update_contacts(state, self.gains)
        return state


def test_a_stance_foot_without_load_is_taken_out_after_its_patience() -> None:
    patience_ms, feet = 5, Feet()
    feet.run(50, PAIR, 0.2, 0)
    feet.force[0] = 0.0
    assert feet.run(patience_ms - 1, PAIR, 0.3, 0).contact[0] == 1.0
    np.testing.assert_array_equal(feet.run(3, PAIR, 0.3, 0).contact, [0.0, 0.0, 0.0, 1.0])
    feet.force[0] = feet.gains.contact_force
    assert feet.run(1, PAIR, 0.4, 0).contact[0] == 1.0  # back at the first loaded tick
    feet.force[0] = 0.0
    assert feet.run(patience_ms - 1, PAIR, 0.3, 0).contact[0] == 1.0, "the patience begins anew"


@pytest.mark.parametrize("rejects", [False, True])
def test_a_foot_that_lands_early_is_a_contact_until_the_switch(rejects: bool) -> None:
    feet = Feet(reject_side_contacts=rejects)
    feet.force[1:3] = 0.0
    feet.run(50, PAIR, 0.3, 0)
    feet.force[1], feet.z[1] = LOAD, FOOT_RADIUS + 0.03
    assert feet.run(5, PAIR, 0.45, 0).contact[1] == 0.0  # the foot is still leaving the ground
    state = feet.run(1, PAIR, 0.6, 0)
    np.testing.assert_array_equal(state.contact, [1.0, 1.0, 0.0, 1.0])
    assert state.ground[1] == pytest.approx(0.03)
    assert state.ground_height == pytest.approx(0.0, abs=1e-12)  # of scheduled feet
    feet.force[1] = 0.0
    state = feet.run(20, PAIR, 0.7, 0)
    assert state.early_contact[1] == 1.0  # a bounce is not a second swing
    assert state.contact[1] == float(not rejects)  # but a foot in the air carries nothing
    feet.force[:] = LOAD
    np.testing.assert_array_equal(feet.run(1, OTHER, 0.0, 1).contact, OTHER)
    assert feet.state.ground[1] == pytest.approx(0.03)


@pytest.mark.parametrize(("progress", "retracts"), [(0.6, True), (0.7, False)])
def test_a_foot_stopped_from_the_side_is_no_contact_but_retracts(
    progress: float, retracts: bool
) -> None:
    """And begins its swing anew once it has been free; late in its swing there is no time left."""
    feet = Feet()
    feet.force[1:3] = 0.0
    feet.run(50, PAIR, 0.3, 0)
    feet.force[1] = LOAD
    feet.state.reaction[1] = [-50.0, 0.0, 20.0]
    state = feet.run(1, PAIR, progress, 0)
    np.testing.assert_array_equal(state.contact, PAIR)
    assert state.retraction[1] == pytest.approx(1e-3 * RETRACTION_MS * retracts)
    feet.force[1] = 0.0
    assert feet.run(RETRACTION_MS - 1, PAIR, 0.65, 0).lift[1] == 0.0
    assert feet.run(2, PAIR, 0.65, 0).lift[1] == 0.65 * retracts
    assert state.retraction[1] == 0.0


def test_a_stance_foot_beside_a_block_is_no_contact_until_it_stands_on_something() -> None:
    feet = Feet()
    feet.force[:] = [LOAD, 0.0, 0.0, 0.0]
    feet.run(20, OTHER, 0.9, 1)
    feet.state.reaction[0] = [50.0, 0.0, 10.0]
    feet.force[0] = 0.0
    assert feet.run(20, PAIR, 0.1, 0).contact[0] == 0.0
    feet.force[0] = LOAD
    assert feet.run(20, PAIR, 0.2, 0).contact[0] == 0.0
    feet.state.reaction[0] = [10.0, 0.0, 50.0]
    assert feet.run(1, PAIR, 0.3, 0).contact[0] == 1.0


def test_a_late_foot_finds_the_ground_where_it_first_bears_load() -> None:
    feet = Feet()
    feet.force[1:3] = 0.0
    feet.run(200, PAIR, 0.3, 0)
    feet.force[:] = [0.0, 0.0, LOAD, 0.0]  # FR is late: it hangs in the air, then sinks
    for height in np.linspace(0.04, -0.02, 31):
        feet.z[1] = FOOT_RADIUS + height
        assert feet.run(1, OTHER, 0.1, 1).ground[1] == 0.0  # what it stood on last, two steps ago
    assert feet.state.contact[1] == 0.0
    feet.force[1] = LOAD
    state = feet.run(1, OTHER, 0.2, 1)
    assert state.contact[1] == 1.0
    assert state.ground[1] == pytest.approx(-0.02)


@pytest.mark.parametrize("late_ms", [3, 12])
def test_the_ground_does_not_ratchet_upward_while_walking(late_ms: int) -> None:
    """Every foot is 1 cm in the air at its scheduled touchdown and lands some ticks later."""
    feet = Feet()
    for half_cycle in range(60):
        stance, swing = (PAIR, OTHER) if half_cycle % 2 == 0 else (OTHER, PAIR)
        for tick in range(100):
            in_air = late_ms > tick
            feet.force = np.where(swing > 0.5, 0.0, 0.0 if in_air else LOAD)
            feet.z = FOOT_RADIUS + np.where(swing > 0.5, 0.05, 0.01 if in_air else 0.0)
            state = feet.run(1, stance, tick / 100, half_cycle)
    assert np.abs(state.ground).max() < 1e-9
    assert abs(state.ground_height) < 1e-9


def test_the_ground_height_follows_the_estimators_drift_smoothly() -> None:
    """A rise of all feet reaches the level monotonically, at the filter's time scale."""
    feet = Feet()
    feet.z += 0.01
    levels = np.array([float(feet.run(1, ALL, 0.5, -1).ground_height) for _ in range(500)])
    assert (np.diff(levels) > 0.0).all()
    assert levels[-1] == pytest.approx(0.01, rel=1e-2)
    assert 40 < int(np.argmax(levels > 0.632 * 0.01)) < 150  # ms: two filters of 50 ms


def test_the_plain_setting_follows_the_schedule_and_filters_the_ground_height() -> None:
    feet, rise = Feet(contact_detection=False), 0.02
    feet.force[:] = 0.0
    feet.z += np.where(PAIR > 0.5, rise, 1.0)  # swing feet do not count
    rate = DT / (0.05 + DT)
    for k in range(1, 50):
        state = feet.run(1, PAIR, 0.9, 0)
        assert state.ground_height == pytest.approx(rise * (1.0 - (1.0 - rate) ** k), rel=1e-9)
    np.testing.assert_array_equal(state.contact, PAIR)
    np.testing.assert_array_equal(feet.run(1, OTHER, 0.0, 1).contact, OTHER)
