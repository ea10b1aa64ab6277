"""What a planner makes of its peers: their windows, their silence, what is set up for them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.gait import horizon_stance, walking_steps
from quadriga.agents.planner.peer_terms import Coupling
from quadriga.agents.planner.peers import LOST, SILENT, PeerSelection
from quadriga.agents.planner.planner import Planner
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from tests.a1 import nominal_forces
from tests.agents.calm import BASE, STEP, inputs_of, peer, plan, terms_of


def test_the_peers_base_is_that_of_its_own_window(small: Config, predictor: Predictor) -> None:
    """The peer's window ends one step earlier, so its deviations count from earlier commands."""
    T_ini, lag = small.planner.T_ini, small.planner.applied
    rising = BASE + np.linspace(0.0, 0.1, T_ini + lag)[:, None] * [0, 1, 0, 0, 0, 0]
    exact = inputs_of(small, y_base_ini=rising[lag:], y_ini=rising[lag:])
    earlier = rising[:T_ini]
    result = plan(small, predictor, exact, peer(small, y_ini=earlier), base=earlier)
    np.testing.assert_allclose(result.du, 0.0, atol=1e-9)


def test_unknown_samples_of_a_peer_count_as_no_deviation(
    small: Config, predictor: Predictor
) -> None:
    unknown = peer(small, known=np.zeros(4, dtype=np.bool_), y_ini=np.full((4, 6), 1e3))
    result = plan(small, predictor, inputs_of(small), unknown)
    np.testing.assert_allclose(result.du, 0.0, atol=1e-9)


def test_a_silent_peer_counts_as_doing_nothing_then_it_is_lost(
    small: Config, predictor: Predictor
) -> None:
    planner, inputs = Planner(small, 0, predictor), inputs_of(small)
    push = np.tile([20.0, 0.0, 0.0], (8, 4))
    pushing = terms_of(small, planner, peer(small, du=push))
    state, before = planner.step(planner.initial(), inputs, pushing)
    assert np.abs(before.du).max() > 0.01
    silent = terms_of(small, planner, peer(small, du=push, status=SILENT, step=STEP - 5, age=4))
    state, during = planner.step(state, inputs, silent)
    np.testing.assert_allclose(during.du, 0.0, atol=1e-9)
    assert (silent.used, silent.ages) == ({"r2": STEP - 5}, {"r2": 4})
    gone = terms_of(small, planner, peer(small, status=LOST, step=STEP - 9, age=8))
    state, after = planner.step(state, inputs, gone)
    assert (after.status, gone.lost) == ("nominal:peer-lost", ("r2",))
    np.testing.assert_array_equal(after.u, nominal_forces(horizon_stance(small, 0, STEP)))
    assert state.solves == 2


@pytest.mark.parametrize(
    ("changes", "behind"),
    [({}, (1,)), ({"compensation": True}, (0,)), ({"exchanges": 2}, (1, 0))],
    ids=["plain", "compensated", "exchanging"],
)
def test_on_the_way_nothing_is_set_up_any_more(
    small: Config,
    predictor: Predictor,
    monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, Any],
    behind: tuple[int, ...],
) -> None:
    config = replace(small, planner=replace(small.planner, **changes))
    planner = Planner(config, 0, predictor)
    monkeypatch.setattr("quadriga.agents.planner.peer_terms.Coupling", None)
    monkeypatch.setattr("quadriga.agents.planner.planner.build_problem", None)
    base, state = np.tile(BASE, (4, 1)), planner.initial()
    first = walking_steps(config).start
    for step in range(first, first + 3 * len(walking_steps(config))):
        for steps in behind:
            terms = planner.peer_terms(PeerSelection((peer(config),), step - steps), step, base)
            state, _ = planner.step(state, inputs_of(config, step), terms)


@given(seed=st.integers(0, 2**32 - 1), peers=st.integers(0, 4))
def test_leaving_out_swinging_legs_changes_nothing(seed: int, peers: int) -> None:
    """A force on one is not believed."""
    rng, N, past = np.random.default_rng(seed), 4, 18 * 3
    G = rng.normal(size=(peers, 6 * N, past + 12 * N))
    stance = [rng.random((N, 4)) < 0.5 for _ in range(peers)]
    told = rng.normal(size=(peers, past + 12 * N))
    z = told.copy()
    for part, pattern in zip(z, stance, strict=True):
        part[past:] *= np.repeat(pattern, 3, axis=1).ravel()
    expected = sum((block @ part for block, part in zip(G, z, strict=True)), np.zeros(6 * N))
    found = Coupling(G, stance).effect(told.ravel().astype(np.float32))
    scale = np.abs(G).max(initial=1.0) * np.abs(z).max(initial=1.0) * z.size
    np.testing.assert_allclose(found, expected[: len(found)], atol=1e-6 * scale, rtol=0)
    assert found.dtype == np.float64
