"""What feet bear, by the torques of a robot whose ground pushes as told, and by its sensors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from quadriga.agents.controller.foot_load import (
    FOOT_LOAD_SIZE,
    Flags,
    FootLoad,
    FootLoadRule,
    foot_load_rule,
    update_foot_load,
)
from quadriga.agents.controller.maths.leg_reaction import LegMotion
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import GRAVITY, N_LEGS, Array
from tests.a1 import GEOMETRY, q_stand
from tests.agents.controller.maths.test_leg_reaction import contact_torques
from tests.agents.controller.poses import BODY, standing_pose
from tests.bridges.robots import real_go1_counts

DT = 1e-3
RULE = foot_load_rule(Config())
LOAD = 60.0  # N, on a foot that stands
HALF_CYCLE = 200  # ticks
SCALES = np.array([0.5, 1.0, 2.0, 4.0])  # counts per N
BIASES = np.array([-80.0, 0.5, 30.0, 200.0])

Sensor = Callable[[int, Array, Array], Array]  # of tick, noise and load: counts
LEVEL = np.array([0.0, 0.0, GRAVITY])
POSE = standing_pose()


def pressed(load: float) -> Array:
    """Torques of legs that stand still and bear a load each, (12,), N·m."""
    force = np.zeros((N_LEGS, 3))
    force[:, 2] = load
    return contact_torques(POSE.q, POSE.v, np.zeros(18), force)


AIR, GROUND = pressed(0.0), pressed(LOAD)


@dataclass
class Trot:
    """Legs that bear load in turn, diagonal pairs together, their joints held still."""

    sensor: Sensor
    rule: FootLoadRule = RULE
    friction: float = 0.0  # N·m, by which all torques are off
    memory: Array = field(default_factory=lambda: np.zeros(FOOT_LOAD_SIZE))
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    tick: int = 0

    def step(self) -> tuple[Array, FootLoad]:
        """True and told loads of the next tick."""
        pair = self.tick // HALF_CYCLE % 2
        stands = np.array([pair == 0, pair == 1, pair == 1, pair == 0])
        tau = np.where(np.repeat(stands, 3), GROUND, AIR) + self.friction
        tau += 0.1 * self.random.standard_normal(12)
        load = np.where(stands, LOAD, 0.0)
        counts = self.sensor(self.tick, self.random.standard_normal(N_LEGS), load)
        rates = 0.05 * self.random.standard_normal(12)
        motion = LegMotion(q_stand(), rates, tau, np.zeros(3), LEVEL)
        told = update_foot_load(
            self.memory, motion, counts, np.eye(3), BODY.links, GEOMETRY, self.rule, DT
        )
        self.tick += 1
        return load, told

    def run(self, ticks: int) -> tuple[Array, Array, Array]:
        """Of the next ticks: true loads, told loads and loaded feet, (ticks, 4)."""
        steps = [self.step() for _ in range(ticks)]
        return (
            np.array([load for load, _ in steps]),
            np.array([told.force for _, told in steps]),
            np.array([told.loaded for _, told in steps]),
        )


def raw(_: int, noise: Array, load: Array) -> Array:
    """Each sensor has a scale and a bias of its own."""
    counts: Array = np.rint(SCALES * (load + noise) + BIASES)
    return counts


def absent(_: int, noise: Array, load: Array) -> Array:
    return np.zeros(N_LEGS)


def dead(_: int, noise: Array, load: Array) -> Array:
    return np.rint(50.0 + noise)


def held(ticks: int) -> Sensor:
    """A sensor that measures every so many ticks, and repeats what it read in between."""
    last = np.zeros(N_LEGS)

    def read(tick: int, noise: Array, load: Array) -> Array:
        if tick % ticks == 0:
            last[:] = raw(tick, 0.05 * noise, load)
        return last

    return read


def settled(ticks: int) -> Flags:
    """Ticks at which no load has just begun or ended."""
    phase = np.arange(ticks) % HALF_CYCLE
    return (phase > 25) & (phase < HALF_CYCLE - 1)


@pytest.mark.parametrize("sensor", [raw, absent, dead])
def test_loads_are_told_whatever_the_sensors_give(sensor: Sensor) -> None:
    load, told, loaded = Trot(sensor).run(1600)
    calm = settled(1600)
    np.testing.assert_array_equal(loaded[calm], load[calm] > 0.0)
    assert np.abs(told[calm] - load[calm]).max() < 8.0
    assert np.abs(told[calm] - load[calm]).mean() < 2.0


@pytest.mark.parametrize("sensor", [raw, absent, dead])
def test_a_load_is_seen_within_some_milliseconds_of_its_beginning_and_end(sensor: Sensor) -> None:
    load, _, loaded = Trot(sensor).run(1600)
    late = (load > 0.0) != loaded
    for begin in range(800, 1600, HALF_CYCLE):
        half_cycle = slice(begin, begin + HALF_CYCLE)
        begins = load[begin] > 0.0
        assert late[half_cycle, begins].sum(axis=0).max() <= 4
        assert late[half_cycle, ~begins].sum(axis=0).max() <= 18


def test_a_compared_sensor_shows_a_load_at_once() -> None:
    trot = Trot(raw)
    trot.run(800)
    load, _, loaded = trot.run(1)
    begun = load[0] > 0.0
    assert begun.sum() == 2
    assert loaded[0][begun].all()


def test_friction_in_the_joints_makes_no_contact_of_a_foot_in_the_air() -> None:
    for friction in (-0.5, 0.5):
        load, _, loaded = Trot(absent, friction=friction).run(800)
        assert not loaded[settled(800)][load[settled(800)] == 0.0].any()


def test_a_sensor_that_fails_is_no_longer_believed() -> None:
    """It repeats what it read under load, while its foot swings."""
    last = raw(0, np.zeros(N_LEGS), np.full(N_LEGS, LOAD))

    def fails(tick: int, noise: Array, load: Array) -> Array:
        return raw(tick, noise, load) if tick < 1400 else last

    trot = Trot(fails)
    trot.run(1400)
    load, _, loaded = trot.run(400)
    calm = settled(400)
    np.testing.assert_array_equal(loaded[calm], load[calm] > 0.0)


def test_a_sensor_that_drops_to_zero_under_load_is_not_believed_for_a_tick() -> None:
    """Its 0 is no lift-off: the load stays that of the torques."""
    end = 1400 + HALF_CYCLE // 2

    def fails(tick: int, noise: Array, load: Array) -> Array:
        return raw(tick, noise, load) if tick < end else np.zeros(N_LEGS)

    trot = Trot(fails)
    trot.run(end)
    load, told, loaded = trot.run(HALF_CYCLE // 2 - 1)
    np.testing.assert_array_equal(loaded, load > 0.0)
    assert np.abs(told - load).max() < 8.0


def test_a_contact_by_torques_ends_at_half_the_load_that_begins_it() -> None:
    memory, found = np.zeros(FOOT_LOAD_SIZE), []
    for load in (0.0, 0.75, 2.0, 0.75, 0.25):  # of the load that begins a contact
        motion = LegMotion(
            q_stand(), np.zeros(12), pressed(load * RULE.least_torque_force), np.zeros(3), LEVEL
        )
        for _ in range(100):
            told = update_foot_load(
                memory, motion, np.zeros(4), np.eye(3), BODY.links, GEOMETRY, RULE, DT
            )
        found.append(told.loaded.tolist())
    assert found == [[carries] * N_LEGS for carries in (False, False, True, True, False)]


def test_a_sensor_is_believed_again_once_it_has_drifted() -> None:
    drift = 30.0  # counts

    def drifts(tick: int, noise: Array, load: Array) -> Array:
        return raw(tick, noise, load) + drift * min(1.0, tick / 10_000)

    trot = Trot(drifts, RULE._replace(memory_time=1.0))
    trot.run(10_000)
    load, told, _ = trot.run(400)
    calm = settled(400)
    # The drift of one second is not known yet, of the least sensitive one 6 N; the rest is noise.
    assert np.abs(told[calm] - load[calm]).max() < 6.0 + 5.0


def test_counts_that_are_held_make_no_load_worse() -> None:
    """Without a sensor, with counts held for 21 ms, with new ones at every tick."""
    errors = []
    for sensor in (absent, held(21), held(1)):
        trot = Trot(sensor)
        trot.run(800)
        load, told, _ = trot.run(1600)
        errors.append(np.sqrt(np.mean((told - load) ** 2)))
    assert errors[1] < errors[0]
    assert errors[2] < 0.5 * errors[0]


def test_counts_of_a_real_go1_help_although_they_are_held() -> None:
    """Its feet bear what they say at each change, and what lies between; joints have friction."""
    rows = real_go1_counts()[:2000]
    fresh = np.flatnonzero(np.any(np.diff(rows, axis=0), axis=1)) + 1
    ticks = np.arange(2 * fresh[0], 2 * fresh[-1])
    loads = np.array([np.interp(ticks, 2 * fresh, row[fresh]) for row in rows.T]).T
    loads = np.maximum(0.0, loads - 120.0) / 12.5  # offset and scale of the Go1's record
    errors = []
    for counts in (np.zeros_like(rows), rows):
        memory, told = np.zeros(FOOT_LOAD_SIZE), []
        for tick, load in zip(ticks, loads, strict=True):
            tau = AIR + np.repeat(load / LOAD, 3) * (GROUND - AIR) + 0.5
            motion = LegMotion(q_stand(), np.zeros(12), tau, np.zeros(3), LEVEL)
            told += [
                update_foot_load(
                    memory, motion, counts[tick // 2], np.eye(3), BODY.links, GEOMETRY, RULE, DT
                ).force
            ]
        errors.append(np.sqrt(np.mean((told - loads)[1000:] ** 2)))
    assert errors[1] < errors[0]


def test_sensors_alone_are_believed_where_they_are_to_be() -> None:
    config = Config()
    rule = foot_load_rule(
        replace(config, controller=replace(config.controller, foot_load="sensor"))
    )
    trot = Trot(lambda tick, noise, load: np.array([3.9, 4.0, 0.0, 80.0]), rule)
    _, told, loaded = trot.run(5)
    np.testing.assert_array_equal(told, np.tile([3.9, 4.0, 0.0, 80.0], (5, 1)))
    np.testing.assert_array_equal(loaded, np.tile([False, True, False, True], (5, 1)))


def test_a_sensor_that_worked_and_then_stays_at_zero_is_forgotten_without_harm() -> None:
    """Its counts' variance decays to nothing; no correlation may be computed from that."""
    trot = Trot(lambda tick, noise, load: SCALES * load if tick < 1000 else np.zeros(N_LEGS))
    trot.rule = trot.rule._replace(memory_time=0.02)
    trot.run(20_000)
    truth, told, _ = trot.run(400)
    assert np.isfinite(told).all()
    assert np.abs(told - truth)[50:200].max() < 20.0
