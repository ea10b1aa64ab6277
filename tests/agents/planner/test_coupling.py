"""The peers' terms without the columns of swinging legs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planner.coupling import Coupling, fill_deviations

T_INI, N, PAST = 3, 4, 18 * 3


@given(seed=st.integers(0, 2**32 - 1), peers=st.integers(0, 4))
def test_leaving_out_swinging_legs_changes_nothing(seed: int, peers: int) -> None:
    rng = np.random.default_rng(seed)
    G = rng.normal(size=(peers, 6 * N, PAST + 12 * N))
    stance = [rng.random((N, 4)) < 0.5 for _ in range(peers)]
    z = rng.normal(size=(peers, PAST + 12 * N))
    for part, pattern in zip(z, stance, strict=True):
        part[PAST:] *= np.repeat(pattern, 3, axis=1).ravel()
    expected = sum((block @ part for block, part in zip(G, z, strict=True)), np.zeros(6 * N))
    found = Coupling(G, stance).effect(z.ravel().astype(np.float32))
    scale = np.abs(G).max(initial=1.0) * np.abs(z).max(initial=1.0) * z.size
    np.testing.assert_allclose(found, expected[: len(found)], atol=1e-6 * scale, rtol=0)
    assert found.dtype == np.float64


def test_a_force_on_a_swinging_leg_is_not_believed() -> None:
    G, stance = np.ones((1, 6 * N, PAST + 12 * N)), np.zeros((N, 4), dtype=np.bool_)
    stance[:, 0] = True
    z = np.zeros(PAST + 12 * N, dtype=np.float32)
    z[PAST + 3] = 1.0  # the second leg's
    assert Coupling(G, [stance]).effect(z) == pytest.approx(0.0)
    z[PAST] = 1.0
    assert Coupling(G, [stance]).effect(z) == pytest.approx(1.0)


def test_deviations_are_flat_and_nothing_is_unknown() -> None:
    rng = np.random.default_rng(0)
    du_ini, du = rng.normal(size=(T_INI, 12)), rng.normal(size=(N, 12))
    y_ini, y_base = rng.normal(size=(2, T_INI, 6))
    known = np.array([True, False, True])
    y_ini[1] = np.nan
    out = np.zeros(PAST + 12 * N, dtype=np.float32)
    fill_deviations(out, du_ini, y_ini, y_base, known, du)
    dy = np.where(known[:, None], y_ini - y_base, 0.0)
    expected = np.concatenate([du_ini.ravel(), dy.ravel(), du.ravel()])
    np.testing.assert_array_equal(out, expected.astype(np.float32))
