"""Harmonics, wrenches, held draws and shrinkage: closed forms and properties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.predictor.episode import N_WRENCH, Episode, wrench_map
from quadriga.agents.predictor.fits import phase_angles, scale_episodes
from quadriga.agents.predictor.periodic import harmonics, polynomials, shrink, spread_over_samples
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.time_grid import gait_phase
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.registry import ROBOTS

META = PredictorMeta.of(Config())


@given(order=st.integers(0, 8))
def test_harmonics_are_orthonormal_over_a_period(order: int) -> None:
    F = harmonics(2 * np.pi * np.arange(40) / 40, order)
    np.testing.assert_allclose(F.T @ F / 40, np.eye(2 * order + 1), atol=1e-12)


@given(degree=st.integers(0, 5))
def test_polynomials_are_orthonormal_and_of_one_half_each(degree: int) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(degree + 2)
    angle = np.concatenate([np.pi * (nodes + 1) / 2, np.pi + np.pi * (nodes + 1) / 2])
    F = polynomials(angle, degree)
    gram = F.T @ (np.tile(weights, 2)[:, None] / 4 * F)
    np.testing.assert_allclose(gram, np.eye(2 * degree + 2), atol=1e-4)  # angles are nudged by 1e-6
    assert not F[: degree + 2, degree + 1 :].any()
    assert not F[degree + 2 :, : degree + 1].any()


def test_a_half_begins_where_the_feet_change_whatever_the_rounding() -> None:
    """Phases 0 and 20 of 40, and those of later periods."""
    phases = np.array([0, 20, 40, 60, 80, 100, 119, 120])
    first = polynomials(2 * np.pi * phases / 40, 0)[:, 0] > 0.0
    assert first.tolist() == [True, False, True, False, True, False, False, True]


def test_a_samples_angle_is_that_of_the_phase_it_begins_in() -> None:
    """Sample 0 ends at `first_tick`; a plan at tick t begins with the sample after it."""
    angles = phase_angles(META, first_tick=1010, count=100)
    for k, angle in enumerate(angles):
        phase = gait_phase(1000 + 10 * k, META.stand_ms, META.stance_ms, 40)
        assert angle == pytest.approx(2 * np.pi * phase / 40)


@pytest.mark.parametrize("kind", ROBOTS)
def test_the_wrench_is_that_of_the_forces_at_the_feet(kind: str) -> None:
    force = np.random.default_rng(1).normal(size=(4, 3))
    feet = np.column_stack([ROBOTS[kind].feet_under_hips, np.zeros(4)])
    wrench, unit = wrench_map(kind) @ force.ravel(), np.eye(3)[0] @ wrench_map(kind)[:3, 0]
    np.testing.assert_allclose(wrench[:3], force.sum(axis=0) * unit)
    moment = np.cross(feet, force).sum(axis=0)
    lever = np.linalg.norm(feet[0])
    np.testing.assert_allclose(wrench[3:], moment * unit / lever, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), hold=st.integers(1, 3))
def test_single_samples_add_up_to_a_held_draw(seed: int, hold: int) -> None:
    """A response that is smooth in its lag is found again from that to held draws."""
    random, step, N = np.random.default_rng(seed), 2 * np.pi / 40, 25
    decay = np.exp(-0.1 * np.arange(N))[:, None] * np.cos(0.2 * np.arange(N))[:, None]
    h = random.normal(size=(6, 1, 4)) * decay
    starts = np.array([k for k in range(40) if k % 20 + hold <= 20]) * step
    F = polynomials(starts, 2)  # of draws that end in the half in which they begin
    held = np.zeros((len(starts), N, 4))
    for m in range(hold):
        response = np.tensordot(polynomials(starts + m * step, 2), h, axes=1)
        held[:, m:] += response[:, : N - m]
    g = np.tensordot(np.linalg.pinv(F), held, axes=1)
    found = spread_over_samples(g, hold, step)
    assert np.linalg.norm(found - h) < 0.05 * np.linalg.norm(h)


@given(hold=st.integers(1, 5), begin=st.integers(0, 4))
@settings(max_examples=20, deadline=None)
def test_how_long_forces_are_held_is_found_in_the_data(hold: int, begin: int) -> None:
    random, T = np.random.default_rng(hold), 120
    du = np.repeat(random.normal(size=(T, 1, 12)), hold, axis=0)[hold - begin % hold :][:T]
    zero = np.zeros((len(du), 1, 6))
    episode = Episode(du, np.zeros_like(du), zero, zero, first_tick=310)
    (walk,), found = scale_episodes([episode], META)
    assert found == hold
    assert walk.starts[0] == begin % hold
    assert (np.diff(walk.starts) == hold).all()
    quiet = replace(episode, u=episode.u_nominal)
    (walk, other), found = scale_episodes([episode, quiet], META)
    assert found == hold
    assert len(walk.starts) > 0
    assert len(other.starts) == 0, "no force, no draw of it"


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_noise_is_no_effect_of_peers_and_what_is_clear_is_left_as_it_is(seed: int) -> None:
    random, F, n = np.random.default_rng(seed), 10, 2
    shape = (5, 6, n, N_WRENCH, n, 6)
    truth = np.zeros(shape)
    truth[:, :, range(n), :, range(n)] = random.normal(size=(n, 5, 6, N_WRENCH, 6))
    truth[:, :, 0, :, 1, 2] = 0.5 * random.normal(size=(5, 6, N_WRENCH))  # robot 1, output vy
    folds = truth + 0.02 * random.normal(size=(F, *shape))
    estimate = folds.mean(axis=0)
    response, kept = shrink(estimate, (F * estimate - folds) / (F - 1))
    expected = np.zeros((n, n, 6), dtype=bool)
    expected[range(n), range(n)] = True
    expected[1, 0, 2] = True
    np.testing.assert_array_equal(kept, expected)
    assert np.linalg.norm(response - truth) < 0.05 * np.linalg.norm(truth)
    assert not response[:, :, 1, :, 0].any()
