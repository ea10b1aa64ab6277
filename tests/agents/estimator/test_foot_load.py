"""What feet bear, by the torques of a robot whose ground pushes as told, and by its sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from quadriga.agents.estimator.foot_load import update_foot_load
from quadriga.shared.robots.conventions import GRAVITY, N_LEGS, Array
from tests.a1 import q_stand
from tests.agents.estimator.poses import GAINS, blank, gains_of, standing_pose
from tests.agents.estimator.test_rigid_body import contact_torques
from tests.bridges.robots import real_go1_counts

LOAD = 60.0  # N, on a foot that stands
HALF_CYCLE = 200  # ticks
SCALES = np.array([0.5, 1.0, 2.0, 4.0])  # counts per N
BIASES = np.array([-80.0, 0.5, 30.0, 200.0])
POSE = standing_pose()

Sensor = Callable[[int, Array, Array], Array]  # of tick, noise and load: counts
Flags = NDArray[np.bool_]


def pressed(load: float) -> Array:
    """Torques of legs that stand still and bear a load each, (12,), N·m."""
    force = np.zeros((N_LEGS, 3))
    force[:, 2] = load
    return contact_torques(POSE.q, POSE.v, np.zeros(18), force)


AIR, GROUND = pressed(0.0), pressed(LOAD)


def still() -> Any:
    """The state of a level robot whose joints are held."""
    state = blank()
    state.q_joint, state.accel, state.quat_wxyz = q_stand(), (0.0, 0.0, GRAVITY), (1.0, 0, 0, 0)
    return state


@dataclass
class Trot:
    """Legs that bear load in turn, diagonal pairs together, their joints held still."""

    sensor: Sensor
    gains: Any = field(default_factory=lambda: GAINS)
    friction: float = 0.0  # N·m, by which all torques are off
    state: Any = field(default_factory=still)
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    tick: int = 0

    def run(self, ticks: int) -> tuple[Array, Array, Flags]:
        """Of the next ticks: true loads, estimated loads and loaded feet, (ticks, 4)."""
        loads, state = np.empty((2, ticks, N_LEGS)), self.state
        loaded = np.empty((ticks, N_LEGS), dtype=bool)
        for k in range(ticks):
            pair = self.tick // HALF_CYCLE % 2
            stands = np.array([pair == 0, pair == 1, pair == 1, pair == 0])
            tau = np.where(np.repeat(stands, 3), GROUND, AIR) + self.friction
            state.tau_joint = tau + 0.1 * self.random.standard_normal(12)
            loads[0, k] = np.where(stands, LOAD, 0.0)
            noise = self.random.standard_normal(N_LEGS)
            state.foot_counts = self.sensor(self.tick, noise, loads[0, k])
            state.v_joint = 0.05 * self.random.standard_normal(12)
            update_foot_load(state, self.gains)
            loads[1, k], loaded[k] = state.foot_force, state.foot_loaded > 0.5
            self.tick += 1
        return loads[0], loads[1], loaded


def raw(_: int, noise: Array, load: Array) -> Array:
    """Each sensor has a scale and a bias of its own."""
    counts: Array = np.rint(SCALES * (load + noise) + BIASES)
    return counts


def absent(_: int, noise: Array, load: Array) -> Array:
    return np.zeros(N_LEGS)


def dead(_: int, noise: Array, load: Array) -> Array:
    return np.rint(50.0 + noise)


def settled(ticks: int) -> Flags:
    """Ticks at which no load has just begun or ended."""
    phase = np.arange(ticks) % HALF_CYCLE
    return (phase > 25) & (phase < HALF_CYCLE - 1)


@pytest.mark.parametrize("sensor", [raw, absent, dead])
def test_loads_are_told_soon_whatever_the_sensors_give(sensor: Sensor) -> None:
    load, estimated, loaded = Trot(sensor).run(1600)
    calm = settled(1600)
    np.testing.assert_array_equal(loaded[calm], load[calm] > 0.0)
    assert np.abs(estimated[calm] - load[calm]).max() < 8.0
    assert np.abs(estimated[calm] - load[calm]).mean() < 2.0
    late = (load > 0.0) != loaded
    for begin in range(800, 1600, HALF_CYCLE):
        half_cycle, begins = slice(begin, begin + HALF_CYCLE), load[begin] > 0.0
        assert late[half_cycle, begins].sum(axis=0).max() <= 4
        assert late[half_cycle, ~begins].sum(axis=0).max() <= 18


def test_a_compared_sensor_shows_a_load_at_once() -> None:
    trot = Trot(raw)
    trot.run(800)
    load, _, loaded = trot.run(1)
    assert (load[0] > 0.0).sum() == 2
    assert loaded[0][load[0] > 0.0].all()


@pytest.mark.parametrize("friction", [-0.5, 0.5])
def test_friction_in_the_joints_makes_no_contact_of_a_foot_in_the_air(friction: float) -> None:
    load, _, loaded = Trot(absent, friction=friction).run(800)
    assert not loaded[settled(800)][load[settled(800)] == 0.0].any()


def test_a_sensor_that_repeats_its_load_in_the_air_is_no_longer_valid() -> None:
    last = raw(0, np.zeros(N_LEGS), np.full(N_LEGS, LOAD))
    trot = Trot(lambda tick, noise, load: raw(tick, noise, load) if tick < 1400 else last)
    trot.run(1400)
    load, _, loaded = trot.run(400)
    np.testing.assert_array_equal(loaded[settled(400)], load[settled(400)] > 0.0)


def test_a_sensor_that_drops_to_zero_under_load_does_not_count_for_a_tick() -> None:
    """Its 0 is no lift-off: the load stays that of the torques."""
    end, zero = 1400 + HALF_CYCLE // 2, np.zeros(N_LEGS)
    trot = Trot(lambda tick, noise, load: raw(tick, noise, load) if tick < end else zero)
    trot.run(end)
    load, estimated, loaded = trot.run(HALF_CYCLE // 2 - 1)
    np.testing.assert_array_equal(loaded, load > 0.0)
    assert np.abs(estimated - load).max() < 8.0


def test_a_contact_by_torques_ends_at_half_the_load_that_begins_it() -> None:
    state, found = still(), []
    for share in (0.0, 0.75, 2.0, 0.75, 0.25):  # of the load that begins a contact
        state.tau_joint = pressed(share * 12.0)
        for _ in range(100):
            update_foot_load(state, GAINS)
        found.append(state.foot_loaded.tolist())
    assert found == [[carries] * N_LEGS for carries in (0.0, 0.0, 1.0, 1.0, 0.0)]


def test_a_sensor_counts_again_once_it_has_drifted() -> None:
    def drifts(tick: int, noise: Array, load: Array) -> Array:
        return raw(tick, noise, load) + 30.0 * min(1.0, tick / 10_000)

    trot = Trot(drifts, gains_of(calibration_time=1.0))
    trot.run(10_000)
    load, estimated, _ = trot.run(400)
    # The drift of one second is not known yet, of the least sensitive one 6 N; the rest is noise.
    assert np.abs(estimated - load)[settled(400)].max() < 6.0 + 5.0


def test_counts_of_a_real_go1_help_although_they_are_held() -> None:
    """Its feet bear what they say at each change, and what lies between; joints have friction."""
    rows = real_go1_counts()[:2000]
    fresh = np.flatnonzero(np.any(np.diff(rows, axis=0), axis=1)) + 1
    ticks = np.arange(2 * fresh[0], 2 * fresh[-1])
    loads = np.array([np.interp(ticks, 2 * fresh, row[fresh]) for row in rows.T]).T
    loads = np.maximum(0.0, loads - 120.0) / 12.5  # offset and scale of the Go1's record
    errors = []
    for counts in (np.zeros_like(rows), rows):
        state, estimated = still(), []
        for tick, load in zip(ticks, loads, strict=True):
            state.tau_joint = AIR + np.repeat(load / LOAD, 3) * (GROUND - AIR) + 0.5
            state.foot_counts = counts[tick // 2]
            update_foot_load(state, GAINS)
            estimated.append(state.foot_force.copy())
        errors.append(np.sqrt(np.mean((estimated - loads)[1000:] ** 2)))
    assert errors[1] < errors[0]


def test_a_sensor_that_worked_and_then_stays_at_zero_is_forgotten_without_harm() -> None:
    """Its counts' variance decays to nothing; no correlation may be computed from that."""
    zero = np.zeros(N_LEGS)
    trot = Trot(
        lambda tick, noise, load: SCALES * load if tick < 1000 else zero,
        gains_of(calibration_time=0.02),
    )
    trot.run(20_000)
    load, estimated, _ = trot.run(400)
    assert np.isfinite(estimated).all()
    assert np.abs(estimated - load)[50:200].max() < 20.0


def test_after_absurd_readings_all_begins_anew() -> None:
    trot = Trot(raw)
    trot.run(800)
    trot.state.v_joint, rates = 1e300, trot.state.v_joint.copy()
    trot.state.omega = np.nan
    update_foot_load(trot.state, GAINS)
    assert not trot.state.foot_loaded.any()
    assert not trot.state.foot_force.any()
    trot.state.omega, trot.state.v_joint = 0.0, rates
    load, estimated, _ = trot.run(300)
    assert np.abs(estimated - load)[settled(300)].max() < 8.0
