"""The distributed planner on a team whose response is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.gait import horizon_stance, walking_steps
from quadriga.agents.planner.peers import LOST, SILENT, Peers, couple
from quadriga.agents.planner.planner import Planner, PlannerState
from quadriga.agents.planner.qp import unpack
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces
from tests.agents.calm import BASE, NOTHING, STEP, Team, inputs_of, peer, plan, terms_of


def test_at_rest_on_the_command_the_plan_is_nominal(small: Config, predictor: Predictor) -> None:
    result = plan(small, predictor, inputs_of(small))
    nominal = nominal_forces(horizon_stance(small, 0, STEP))
    assert result.status == "solved"
    np.testing.assert_allclose(result.u, nominal, atol=1e-9)
    np.testing.assert_allclose(result.y, np.tile(BASE, (8, 1)), atol=1e-9)


def test_the_planned_outputs_are_what_the_team_will_do(
    small: Config, predictor: Predictor, linear_team: Team
) -> None:
    """Eq. 10 with true past and true plans of the peer: the prediction comes true."""
    team, rng = linear_team(2), np.random.default_rng(3)
    T_ini, N = small.planner.T_ini, small.planner.N
    u_peer = 5.0 * rng.normal(size=(N, 12))
    past = 10.0 * rng.normal(size=(40, 2, 12))
    y = BASE + team.respond(past)
    first = inputs_of(
        small,
        u_ini=nominal_forces(np.ones((T_ini, 4), dtype=np.bool_)) + past[-T_ini:, 0],
        y_ini=y[-T_ini:, 0],
    )
    # The peer's window and plan refer to the same instant here, as with no delay.
    other = peer(small, du_ini=past[-T_ini:, 1], y_ini=y[-T_ini:, 1], du=u_peer)
    result = plan(small, predictor, first, other)
    assert np.abs(result.du).max() > 1.0
    future = np.stack([result.du, u_peer], axis=1)
    happened = BASE + team.respond(np.concatenate([past, future]))[40:, 0]
    np.testing.assert_allclose(result.y, happened, atol=1e-6)
    future[:, 0] = 0.0
    otherwise = BASE + team.respond(np.concatenate([past, future]))[40:, 0]
    np.testing.assert_allclose(result.y_nominal, otherwise, atol=1e-6)


@pytest.mark.parametrize("size", [0.05, 1.0, 3.0])
def test_the_qp_is_that_of_eq_12_written_out(
    small: Config, predictor: Predictor, size: float
) -> None:
    """With forces within and at their limits."""
    rng = np.random.default_rng(9)
    stance = rng.random((4, 4)) < 0.5
    inputs = inputs_of(
        small,
        u_ini=nominal_forces(stance) + 5.0 * size * rng.normal(size=(4, 12)),
        stance_ini=stance,
        y_ini=BASE + 0.05 * size * rng.normal(size=(4, 6)),
        y_des=BASE + 0.05 * size * rng.normal(size=(8, 6)),
    )
    planner = Planner(small, 0, predictor)
    terms = terms_of(small, predictor, peer(small, du=size * rng.normal(size=(8, 12))))
    solved = planner.problem_of(PlannerState(), inputs, terms)
    assert solved is not None
    _, result = planner.step(PlannerState(), inputs, terms)
    G, past = predictor.block(0, 0), predictor.meta.layout.past
    y_free = G[:, :past] @ inputs.past() + terms.effect
    error = y_free - (inputs.y_des - inputs.y_base).ravel()
    weighted = G[:, past:][:, solved.problem.columns].T * np.tile(small.planner.Q, 8)
    np.testing.assert_allclose(solved.f, weighted @ error, atol=1e-9)
    assert (solved.solution.iterations > 0) == (size > 0.1)
    du, dy = unpack(solved.problem, solved.solution.x, y_free)
    np.testing.assert_array_equal(result.du, du)
    np.testing.assert_array_equal(result.u, nominal_forces(horizon_stance(small, 0, STEP)) + du)
    np.testing.assert_allclose(result.y, inputs.y_base + dy, atol=1e-12)
    np.testing.assert_allclose(result.y_nominal, inputs.y_base + y_free.reshape(8, 6), atol=1e-12)
    assert result.residuals == solved.solution.residuals


def test_swing_legs_carry_exactly_nothing(small: Config, predictor: Predictor) -> None:
    wish = np.tile(BASE + 0.02, (8, 1))
    for step in range(30):
        result = plan(small, predictor, inputs_of(small, step=step, y_des=wish))
        swing = ~horizon_stance(small, 0, step)
        assert (result.u.reshape(8, 4, 3)[swing] == 0.0).all()


def test_without_a_solution_the_plan_is_nominal(small: Config, predictor: Predictor) -> None:
    bounds = replace(small.planner, force_min=50.0, deviation_max=(20.0, 20.0, 5.0))
    impossible = replace(small, planner=bounds)
    wish = np.tile(BASE + 0.02, (8, 1))
    standing = plan(impossible, predictor, inputs_of(small, step=0, y_des=wish))
    assert standing.status == "nominal:infeasible"
    np.testing.assert_array_equal(standing.u, nominal_forces(horizon_stance(small, 0, 0)))
    np.testing.assert_allclose(standing.y, np.tile(BASE, (8, 1)), atol=1e-9)
    walking = plan(impossible, predictor, inputs_of(small, y_des=wish))
    assert walking.status == "solved"


def test_equal_inputs_give_equal_bits_whatever_came_before(
    small: Config, predictor: Predictor
) -> None:
    rng = np.random.default_rng(5)
    various = [
        inputs_of(small, step=int(step), y_ini=BASE + 0.01 * rng.normal(size=(4, 6)))
        for step in rng.integers(8, 28, 12)
    ]
    used = Planner(small, 0, predictor)
    first = [used.step(PlannerState(), one, NOTHING)[1] for one in various]
    for one, expected in reversed(list(zip(various, first, strict=True))):
        for planner in (used, Planner(small, 0, predictor)):
            again = planner.step(PlannerState(), one, NOTHING)[1]
            assert again.u.tobytes() == expected.u.tobytes()
            assert again.y.tobytes() == expected.y.tobytes()


def test_a_predictor_of_another_size_is_refused(small: Config, predictor: Predictor) -> None:
    bigger = replace(small, team=replace(small.team, robots=3))
    with pytest.raises(PredictorError, match=r"got \(robots, N, T_ini\) = \(2, 8, 4\)"):
        Planner(bigger, 0, predictor)


def test_damping_mixes_in_the_last_plan_brought_forward(
    small: Config, predictor: Predictor
) -> None:
    wish = np.tile(BASE + np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]), (8, 1))
    inputs, share = inputs_of(small, y_des=wish), 0.25
    damped = replace(small, planner=replace(small.planner, damping=share))
    undamped, planner = Planner(small, 0, predictor), Planner(damped, 0, predictor)
    last: Array = 3.0 * np.repeat(horizon_stance(small, 0, STEP - 1), 3, axis=1).astype(float)
    state = PlannerState(STEP - 1, last)
    _, free = undamped.step(state, inputs, NOTHING)
    _, mixed = planner.step(state, inputs, NOTHING)
    forward = np.zeros((8, 12))
    forward[:4] = last[4:]
    np.testing.assert_allclose(mixed.du, (1 - share) * free.du + share * forward, atol=1e-9)
    _, again = planner.step(PlannerState(STEP, free.du), inputs, NOTHING)
    np.testing.assert_allclose(again.du, free.du, atol=1e-9)
    effect = predictor.future_block(0, 0) @ (mixed.du - free.du).ravel()
    np.testing.assert_allclose(mixed.y - free.y, effect.reshape(8, 6), atol=1e-9)


def test_output_bounds_are_kept(small: Config, predictor: Predictor) -> None:
    """Pulled towards a speed beyond the bound, the plan stops at it."""
    wish = np.tile(BASE, (8, 1))
    start = np.tile(BASE + np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]), (4, 1))
    inputs = inputs_of(small, y_ini=start, y_des=wish)
    free = plan(small, predictor, inputs).y - wish
    limit = 0.8 * float(np.abs(free[3:, 1]).max())
    far = (10.0, limit, 10.0, 10.0, 10.0, 10.0)
    planner = replace(small.planner, output_bounds="hard", output_max=far, deviation_max=(1e3,) * 3)
    bounded = plan(replace(small, planner=planner), predictor, inputs)
    excess = np.abs(bounded.y - wish)[:, 1].max() - limit
    assert np.abs(free[:, 1]).max() > limit
    assert bounded.status in ("solved", "nominal:infeasible")
    assert bounded.status == "nominal:infeasible" or excess < 1e-6


# ---- what it makes of its peers


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
    pushing = terms_of(small, predictor, peer(small, du=push))
    state, before = planner.step(PlannerState(), inputs, pushing)
    assert np.abs(before.du).max() > 0.01
    silent = terms_of(small, predictor, peer(small, du=push, status=SILENT, step=STEP - 5, age=4))
    state, during = planner.step(state, inputs, silent)
    np.testing.assert_allclose(during.du, 0.0, atol=1e-9)
    assert silent.used == {"r2": STEP - 5}
    gone = terms_of(small, predictor, peer(small, status=LOST, step=STEP - 9, age=8))
    _, after = planner.step(state, inputs, gone)
    assert (after.status, gone.lost) == ("nominal:peer-lost", ("r2",))
    np.testing.assert_array_equal(after.u, nominal_forces(horizon_stance(small, 0, STEP)))


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
    planner, coupling = Planner(config, 0, predictor), Peers(config, 0, predictor)
    monkeypatch.setattr("quadriga.agents.planner.peers.couple", None)
    monkeypatch.setattr("quadriga.agents.planner.planner.build_problem", None)
    base, state = np.tile(BASE, (4, 1)), PlannerState()
    first = walking_steps(config).start
    for step in range(first, first + 3 * len(walking_steps(config))):
        for steps in behind:
            terms = coupling.terms((peer(config),), step, step - steps, base)
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
    columns, rows = couple(G, stance)
    found = rows @ told.ravel().astype(np.float32)[columns]
    scale = np.abs(G).max(initial=1.0) * np.abs(z).max(initial=1.0) * z.size
    np.testing.assert_allclose(found, expected[: len(found)], atol=1e-6 * scale, rtol=0)
