"""Contacts and ground heights from schedule and foot force."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from quadriga.agents.controller.schedule import Schedule
from quadriga.shared.config.sections import ControllerConfig, GaitConfig
from quadriga.shared.robots.conventions import Array
from tests.a1 import FOOT_RADIUS
from tests.agents.controller.parts import ContactState, initial_contact, step_contact

DETECTING = ControllerConfig()
WAITING = replace(DETECTING, liftoff_hold_ms=40)
SCHEDULED = replace(DETECTING, contact_detection=False)
DT = 1e-3
LOAD = 50.0
PAIR, OTHER = np.array([1.0, 0.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0, 0.0])


@dataclass
class Feet:
    """Four feet, each on ground of height zero with its load, stepped through the detector."""

    config: ControllerConfig = DETECTING
    state: ContactState = field(default_factory=initial_contact)
    force: Array = field(default_factory=lambda: np.full(4, LOAD))
    z: Array = field(default_factory=lambda: np.full(4, FOOT_RADIUS))

    def run(self, ticks: int, stance: Array, progress: float, half_cycle: int) -> ContactState:
        schedule = Schedule(stance, progress, half_cycle)
        for _ in range(ticks):
            self.state = step_contact(self.state, self.config, schedule, self.force, self.z, DT)
        return self.state


def test_standing_feet_are_contacts_on_level_ground() -> None:
    state = Feet().run(100, np.ones(4), 0.5, -1)
    np.testing.assert_array_equal(state.feet.contact, np.ones(4))
    np.testing.assert_allclose(state.feet.ground, 0.0, atol=1e-15)
    assert abs(state.ground_height) < 1e-15


@pytest.mark.parametrize("patience_ms", [1, 5, 20])
def test_a_stance_foot_without_load_is_taken_out_after_its_patience(patience_ms: int) -> None:
    feet = Feet(replace(DETECTING, lost_contact_ms=patience_ms))
    feet.run(50, PAIR, 0.2, 0)
    feet.force[0] = 0.0
    assert feet.run(patience_ms - 1, PAIR, 0.3, 0).feet.contact[0] == 1.0
    state = feet.run(3, PAIR, 0.3, 0)
    np.testing.assert_array_equal(state.feet.contact, [0.0, 0.0, 0.0, 1.0])
    feet.force[0] = DETECTING.contact_force
    assert feet.run(1, PAIR, 0.4, 0).feet.contact[0] == 1.0  # back at the first loaded tick


def test_a_single_tick_of_load_starts_the_patience_anew() -> None:
    feet = Feet()
    for _ in range(5):
        feet.force[0] = 0.0
        feet.run(4, PAIR, 0.3, 0)
        feet.force[0] = LOAD
        assert feet.run(1, PAIR, 0.3, 0).feet.contact[0] == 1.0


@pytest.mark.parametrize("rejects", [False, True])
def test_a_foot_that_lands_early_is_a_contact_until_the_switch(rejects: bool) -> None:
    feet = Feet(replace(DETECTING, reject_side_contacts=rejects))
    feet.force[1:3] = 0.0
    feet.run(50, PAIR, 0.3, 0)
    feet.force[1], feet.z[1] = LOAD, FOOT_RADIUS + 0.03
    assert feet.run(5, PAIR, 0.45, 0).feet.contact[1] == 0.0  # the foot is still leaving the ground
    state = feet.run(1, PAIR, 0.6, 0)
    np.testing.assert_array_equal(state.feet.contact, [1.0, 1.0, 0.0, 1.0])
    assert state.feet.ground[1] == pytest.approx(0.03)
    assert state.ground_height == pytest.approx(0.0, abs=1e-12)  # of scheduled feet
    feet.force[1] = 0.0
    state = feet.run(20, PAIR, 0.7, 0)
    assert state.feet.early_contact[1] == 1.0  # a bounce is not a second swing
    assert state.feet.contact[1] == float(not rejects)  # but a foot in the air carries nothing
    feet.force[:] = LOAD
    state = feet.run(1, OTHER, 0.0, 1)
    np.testing.assert_array_equal(state.feet.contact, OTHER)
    assert state.feet.ground[1] == pytest.approx(0.03)


def stopped_from_the_side() -> Feet:
    """One of two feet that swing."""
    feet = Feet()
    feet.force[1:3] = 0.0
    feet.run(50, PAIR, 0.3, 0)
    feet.force[1] = LOAD
    feet.state.feet.reaction[1] = [-50.0, 0.0, 20.0]
    return feet


def test_a_foot_stopped_from_the_side_is_no_contact_but_backs_off() -> None:
    """And begins its swing anew once nothing has stopped it for the time of the reflex."""
    feet = stopped_from_the_side()
    state = feet.run(1, PAIR, 0.6, 0)
    np.testing.assert_array_equal(state.feet.contact, PAIR)
    assert state.feet.reflex[1] == pytest.approx(1e-3 * DETECTING.reflex_ms)
    feet.force[1] = 0.0
    assert feet.run(DETECTING.reflex_ms - 1, PAIR, 0.65, 0).feet.lift[1] == 0.0
    state = feet.run(2, PAIR, 0.65, 0)
    assert state.feet.lift[1] == 0.65
    assert state.feet.reflex[1] == 0.0


def test_late_in_its_swing_a_foot_backs_off_no_more() -> None:
    """It would have to swing anew in less time than its leg can do it in."""
    feet = stopped_from_the_side()
    state = feet.run(1, PAIR, 0.7, 0)
    np.testing.assert_array_equal(state.feet.contact, PAIR)
    assert state.feet.reflex[1] == 0.0
    assert feet.run(20, PAIR, 0.75, 0).feet.lift[1] == 0.0


def test_a_stance_foot_beside_a_block_is_no_contact_until_it_stands_on_something() -> None:
    feet = Feet()
    feet.force[:] = [LOAD, 0.0, 0.0, 0.0]
    feet.run(20, OTHER, 0.9, 1)
    feet.state.feet.reaction[0] = [50.0, 0.0, 10.0]
    feet.force[0] = 0.0
    assert feet.run(20, PAIR, 0.1, 0).feet.contact[0] == 0.0
    feet.force[0] = LOAD
    assert feet.run(20, PAIR, 0.2, 0).feet.contact[0] == 0.0
    feet.state.feet.reaction[0] = [10.0, 0.0, 50.0]
    assert feet.run(1, PAIR, 0.3, 0).feet.contact[0] == 1.0


def test_feet_wait_to_swing_until_the_others_carry() -> None:
    feet = Feet(WAITING)
    feet.run(50, PAIR, 0.9, 0)
    feet.force[1] = 0.0  # FR is late
    state = feet.run(3, OTHER, 0.05, 1)
    np.testing.assert_array_equal(state.feet.contact, np.ones(4))
    assert (state.feet.lift[[0, 3]] == -1.0).all()
    feet.force[1] = LOAD
    state = feet.run(1, OTHER, 0.1, 1)
    np.testing.assert_array_equal(state.feet.contact, OTHER)
    assert (state.feet.lift[[0, 3]] == 0.1).all()


def test_feet_wait_no_longer_than_they_may() -> None:
    feet = Feet(WAITING)
    feet.run(50, PAIR, 0.9, 0)
    feet.force[1] = 0.0
    hold = WAITING.liftoff_hold_ms / GaitConfig().stance_ms
    assert feet.run(1, OTHER, 0.99 * hold, 1).feet.contact[0] == 1.0
    assert feet.run(1, OTHER, hold, 1).feet.contact[0] == 0.0


def test_a_late_foot_finds_the_ground_where_it_first_bears_load() -> None:
    feet = Feet()
    feet.force[1:3] = 0.0
    feet.run(200, PAIR, 0.3, 0)
    feet.force[:] = [0.0, 0.0, LOAD, 0.0]  # FR is late: it hangs in the air, then sinks
    for height in np.linspace(0.04, -0.02, 31):
        feet.z[1] = FOOT_RADIUS + height
        before = feet.run(1, OTHER, 0.1, 1)
        assert before.feet.ground[1] == 0.0  # what it stood on last, two steps ago
    assert before.feet.contact[1] == 0.0
    feet.force[1] = LOAD
    state = feet.run(1, OTHER, 0.2, 1)
    assert state.feet.contact[1] == 1.0
    assert state.feet.ground[1] == pytest.approx(-0.02)


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
    assert np.abs(state.feet.ground).max() < 1e-9
    assert abs(state.ground_height) < 1e-9


def test_the_ground_height_follows_the_estimators_drift_smoothly() -> None:
    """A rise of all feet reaches the level monotonically, at the filter's time scale."""
    feet = Feet()
    feet.z += 0.01
    levels = np.array([feet.run(1, np.ones(4), 0.5, -1).ground_height for _ in range(500)])
    assert (np.diff(levels) > 0.0).all()
    assert levels[-1] == pytest.approx(0.01, rel=1e-2)
    reached = int(np.argmax(levels > 0.632 * 0.01))
    assert 40 < reached < 150  # ms, of a filter of 50 ms behind another


def test_the_plain_setting_believes_the_schedule() -> None:
    feet = Feet(SCHEDULED)
    feet.force[:] = [0.0, LOAD, LOAD, 0.0]
    state = feet.run(50, PAIR, 0.9, 0)
    np.testing.assert_array_equal(state.feet.contact, PAIR)
    np.testing.assert_array_equal(feet.run(1, OTHER, 0.0, 1).feet.contact, OTHER)


def test_the_plain_settings_ground_height_is_a_first_order_filter() -> None:
    feet, rise = Feet(SCHEDULED), 0.02
    feet.z[[0, 3]] += rise
    feet.z[[1, 2]] += 1.0  # swing feet do not count
    rate = DT / (1e-3 * SCHEDULED.ground_filter_ms + DT)
    for k in (1, 10, 50):
        feet.state = initial_contact()
        level = feet.run(k, PAIR, 0.5, 0).ground_height
        assert level == pytest.approx(rise * (1.0 - (1.0 - rate) ** k), rel=1e-9)


def test_a_filter_of_no_time_follows_at_once() -> None:
    feet = Feet(replace(DETECTING, ground_filter_ms=0.0))
    feet.z += 0.01
    assert feet.run(1, np.ones(4), 0.5, -1).ground_height == pytest.approx(0.01)
