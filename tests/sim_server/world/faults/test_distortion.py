from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.shared.robot.conventions import Array
from quadriga.shared.robot.robots import ROBOTS
from quadriga.sim_server.world.faults.components import build_components
from quadriga.sim_server.world.faults.distortion import Distortion
from quadriga.sim_server.world.faults.fault import KINDS, SPAN_MS, ComponentFault

COMPONENTS = build_components(ROBOTS["a1"])
(GYRO,) = COMPONENTS["gyro"]
START, STOP = 100, 300


def run(kind: str, seed: int = 0) -> Array:
    """What a gyro says in 400 ticks whose sound values are tick, tick + 0.5 and −tick."""
    fault = ComponentFault("r1", "gyro", kind, START, STOP)
    distortion = Distortion(fault, GYRO, np.random.default_rng(seed))
    return np.array([distortion.distort(tick, sound(tick)) for tick in range(400)])


def sound(tick: int) -> Array:
    return np.array([tick, tick + 0.5, -tick], dtype=float)


SOUND = np.array([sound(tick) for tick in range(400)])
EXPECTED: dict[str, Callable[[int], Array]] = {
    "off": lambda _tick: np.zeros(3),
    "stuck": lambda _tick: sound(START - 1),
    "wrong": lambda tick: -sound(tick),
    "slow": lambda tick: sound(START + (tick - START) // SPAN_MS * SPAN_MS),
    "delayed": lambda tick: sound(tick - SPAN_MS),
}


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_changed_before_and_after(kind: str) -> None:
    values = run(kind)
    np.testing.assert_array_equal(values[:START], SOUND[:START])
    np.testing.assert_array_equal(values[STOP:], SOUND[STOP:])


@pytest.mark.parametrize("kind", EXPECTED)
def test_what_a_fault_makes_of_a_signal(kind: str) -> None:
    expected = np.array([EXPECTED[kind](tick) for tick in range(START, STOP)])
    np.testing.assert_array_equal(run(kind)[START:STOP], expected)


def test_garbage_fills_the_range_and_is_drawn_from_the_seed() -> None:
    values = run("garbage")[START:STOP]
    assert np.all((GYRO.low <= values) & (values <= GYRO.high))
    assert np.all(values.std(axis=0) > 0.4 * GYRO.high)
    np.testing.assert_array_equal(values, run("garbage")[START:STOP])
    assert not np.array_equal(values, run("garbage", seed=1)[START:STOP])


def test_intermittent_is_off_for_whole_spans() -> None:
    shares = []
    for seed in range(50):
        off = np.all(run("intermittent", seed)[START:STOP] == 0.0, axis=1)
        spans = off.reshape(-1, SPAN_MS)
        assert np.all(spans == spans[:, :1])
        shares.append(spans[:, 0].mean())
    assert 0.35 < np.mean(shares) < 0.65  # 200 spans: four standard deviations are 0.14


@given(
    kind=st.sampled_from(list(KINDS)),
    name=st.sampled_from(list(COMPONENTS)),
    seed=st.integers(0, 99),
)
def test_numbers_stay_finite_and_orientations_of_unit_length(
    kind: str, name: str, seed: int
) -> None:
    random = np.random.default_rng(seed)
    for component in COMPONENTS[name]:
        distortion = Distortion(ComponentFault("r1", name, kind, 2), component, random)
        for tick in range(60):
            values = random.normal(size=len(component.columns))
            if component.unit_length:
                values /= np.linalg.norm(values)
            found = distortion.distort(tick, values)
            assert np.all(np.isfinite(found))
            if component.unit_length and kind not in ("off", "intermittent"):
                assert np.linalg.norm(found) == pytest.approx(1.0)
