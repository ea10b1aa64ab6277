"""Cooperative plans: each step lowers the team's cost, and they become the central planner's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.gait import horizon_stance
from quadriga.agents.planner.cooperation import (
    cooperative_radius,
    coupled_peers,
    is_cooperative,
    kept_share,
    new_plan_share,
)
from quadriga.agents.planner.peers import PeerData, Peers
from quadriga.agents.planner.planner import Planner, PlannerState
from quadriga.agents.planner.team import build_centralised
from quadriga.agents.predictor.gates import iteration_radius, radius_limit, run_gates
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, PredictorError
from quadriga.shared.robots.conventions import Array
from tests.a1 import nominal_forces
from tests.agents.calm import BASE, STEP, Team, inputs_of, peer, team_cost, terms_of
from tests.agents.conftest import fit_ridge

ROUNDS = 200  # within which strongly coupled plans are as good as the central planner's


def cooperative(config: Config, robots: int = 3, **changes: Any) -> Config:
    """The configuration with the team's cost."""
    planner = replace(config.planner, cost="team", **changes)
    return replace(config, team=replace(config.team, robots=robots), planner=planner)


def coupled(config: Config, seed: int, strength: float) -> Predictor:
    """Any G of a plausible size whose blocks off the diagonal are `strength` times as large.

    What a robot does to itself it does to others too, in part, so that the blocks are alike.
    """
    meta = PredictorMeta.of(config)
    rng, n = np.random.default_rng(seed), meta.robots
    shape = (meta.N, 6, meta.layout.width)
    size = 1e-4 * np.array([1.0, 30.0, 30.0, 10.0, 10.0, 30.0])[:, None]
    own = [rng.normal(size=shape) * size for _ in range(n)]
    G = np.empty((1, n, n, 6 * meta.N, meta.layout.width))
    for i in range(n):
        for j in range(n):
            mixed = own[j] if i == j else strength * (own[j] + 0.3 * rng.normal(size=shape) * size)
            G[0, i, j] = mixed.reshape(6 * meta.N, meta.layout.width)
    return Predictor(meta, G)


class Round:
    """A team whose windows stay as they are, and whose agents plan again and again."""

    def __init__(self, config: Config, predictor: Predictor, seed: int, size: float) -> None:
        rng, planner = np.random.default_rng(seed), config.planner
        scale = size * np.array([0.004, 0.1, 0.1, 0.02, 0.02, 0.1])
        y_des = np.tile(BASE + 0.2 * scale * rng.normal(size=6), (planner.N, 1))
        self.config, self.predictor = config, predictor
        self.inputs = [
            inputs_of(
                config,
                u_ini=nominal_forces(np.ones((planner.T_ini, 4), dtype=np.bool_))
                + 5.0 * size * rng.normal(size=(planner.T_ini, 12)),
                y_ini=BASE + scale * rng.normal(size=(planner.T_ini, 6)),
                y_des=y_des,
            )
            for _ in range(config.team.robots)
        ]
        self.planners = [Planner(config, i, predictor) for i in range(config.team.robots)]
        self.coupling = [Peers(config, i, predictor) for i in range(config.team.robots)]
        self.states = [PlannerState() for planner in self.planners]
        self.du = np.zeros((config.team.robots, planner.N, 12))

    def plan(self) -> None:
        """Every agent plans with its peers' last plans."""
        new = []
        for i, planner in enumerate(self.planners):
            peers = tuple(self._data(j) for j in range(len(self.planners)) if j != i)
            base = self.inputs[i].y_base_ini
            terms = self.coupling[i].terms(peers, STEP, STEP, base)
            self.states[i], result = planner.step(self.states[i], self.inputs[i], terms)
            assert result.status == "solved"
            new.append(result.du)
        self.du = np.array(new)

    def best(self) -> Array:
        """Force deviations of the central planner, (n, N, 12)."""
        result = build_centralised(self.config, self.predictor).step(self.inputs)
        stance = [horizon_stance(self.config, i, STEP) for i in range(len(self.inputs))]
        return result.u - nominal_forces(np.stack(stance))

    def cost(self, du: Array) -> float:
        """The team's cost, written out."""
        return team_cost(self.config, self.predictor, self.inputs, du)

    def _data(self, j: int) -> PeerData:
        own = self.inputs[j]
        du_ini = own.u_ini - nominal_forces(own.stance_ini)
        return peer(
            self.config,
            robot=f"r{j + 1}",
            index=j,
            step=STEP,
            du_ini=du_ini,
            y_ini=own.y_ini,
            du=self.du[j],
        )


@given(
    seed=st.integers(0, 2**32 - 1),
    strength=st.floats(0.0, 3.0),
    size=st.sampled_from([0.1, 1.0, 4.0]),
    damping=st.sampled_from([0.0, 2 / 3, 0.9]),
)
@settings(deadline=None, max_examples=6)
def test_no_round_of_plans_raises_the_team_s_cost(
    small: Config, seed: int, strength: float, size: float, damping: float
) -> None:
    """With bounds that are active or not, with the automatic share of the last plan or 1 − 1/n."""
    config = cooperative(small, damping=damping)
    predictor = coupled(config, seed, strength)
    assert cooperative_radius(config, predictor) < 1.0
    rounds = Round(config, predictor, seed, size)
    cost = rounds.cost(rounds.du)
    for _ in range(5):
        rounds.plan()
        now = rounds.cost(rounds.du)
        assert now <= cost * (1.0 + 1e-9)
        cost = now


@pytest.mark.parametrize(("size", "bounded"), [(0.3, False), (3.0, True)])
def test_strongly_coupled_plans_become_the_central_planner_s(
    small: Config, size: float, bounded: bool
) -> None:
    """Where best responses diverge, with forces at their bounds or none there.

    What is lost against the optimum falls below 0.1 % of what was lost without plans.
    """
    config = cooperative(small)
    predictor = coupled(config, 5, 0.5)
    assert iteration_radius(small_own(config), predictor) > 1.1
    assert iteration_radius(config, predictor) < 1.0
    rounds = Round(config, predictor, 7, size)
    first, best = rounds.cost(rounds.du), rounds.best()
    lowest = rounds.cost(best)
    at_bounds = np.abs(best[..., 0::3]) > small.planner.deviation_max[0] - 1e-6
    assert (at_bounds.mean() > 0.05) == bounded
    for _ in range(ROUNDS):
        rounds.plan()
    assert 0.0 <= rounds.cost(rounds.du) - lowest < 1e-3 * (first - lowest)
    np.testing.assert_allclose(rounds.du, best, atol=1.0)


def test_best_responses_of_the_same_team_do_not(small: Config) -> None:
    config = cooperative(small)
    predictor = coupled(config, 5, 0.5)
    rounds = Round(small_own(config), predictor, 7, 0.3)
    lowest = rounds.cost(rounds.best())
    for _ in range(ROUNDS):
        rounds.plan()
    assert rounds.cost(rounds.du) > 100.0 * lowest


def test_the_slope_is_that_of_the_team_s_cost(small: Config, linear_team: Team) -> None:
    """At the last plan that of the QP is w times it, against differences of the cost."""
    config = cooperative(small)
    meta = replace(PredictorMeta.of(config), ridge=1e-10, block_weight=1.0)
    rounds = Round(config, fit_ridge([linear_team(3).episode(2500, 1)], meta), 3, 1.0)
    rounds.plan()
    at, planner = rounds.du, rounds.planners[1]
    peers = tuple(rounds._data(j) for j in (0, 2))
    base = rounds.inputs[1].y_base_ini
    terms = rounds.coupling[1].terms(peers, STEP, STEP, base)
    qp = planner.problem_of(rounds.states[1], rounds.inputs[1], terms)
    assert qp is not None
    w = new_plan_share(config, rounds.predictor)
    slope = (qp.problem.H @ at[1].ravel()[qp.problem.columns] + qp.f) / w
    for place in range(0, len(slope), 7):
        step = np.zeros_like(at)
        step[1].flat[qp.problem.columns[place]] = 0.1
        rise = (rounds.cost(at + step) - rounds.cost(at - step)) / 0.4  # the cost is twice V
        assert slope[place] == pytest.approx(rise, rel=1e-4, abs=1e-4 * np.abs(slope).max())


def test_the_innovation_is_answered_in_full_and_all_else_in_part(small: Config) -> None:
    """One step after a plan: the same window as it predicted, and one that is off it."""
    config = cooperative(small)
    predictor = coupled(config, 4, 0.5)
    planner, w = Planner(config, 0, predictor), new_plan_share(config, predictor)
    assert w < 0.9
    before, applied, T_ini = inputs_of(config, STEP), small.planner.applied, small.planner.T_ini
    terms = terms_of(config, predictor, peer(config), peer(config, robot="r3", index=2))
    state, first = planner.step(PlannerState(), before, terms)
    stance = horizon_stance(config, 0, STEP)[:applied]
    expected = inputs_of(
        config,
        STEP + 1,
        u_ini=np.concatenate([before.u_ini[applied:], nominal_forces(stance) + first.du[:applied]]),
        y_ini=np.concatenate([before.y_ini[applied:], first.y[:applied]]),
        stance_ini=np.concatenate([before.stance_ini[applied:], stance]),
    )
    calm = planner.step(state, expected, terms)[1]
    off = np.zeros((T_ini, 6))
    off[-1] = 0.003, 0.05, 0.05, 0.01, 0.01, 0.05
    surprised = planner.step(state, replace(expected, y_ini=expected.y_ini + off), terms)[1]
    qp = planner.problem_of(state, expected, terms)
    assert qp is not None
    F_past, H = qp.problem.condensed.F_past, qp.problem.H
    innovation = np.concatenate([np.zeros(12 * T_ini), off.ravel()])
    answer = -np.linalg.solve(H, F_past @ innovation)
    moved = (surprised.du - calm.du).ravel()[qp.problem.columns]
    np.testing.assert_allclose(moved, answer, atol=1e-6)
    assert np.abs(answer).max() > 0.01


def test_the_share_is_the_one_that_contracts_fastest(small: Config) -> None:
    config = cooperative(small)
    predictor = coupled(config, 11, 0.8)
    automatic = cooperative_radius(config, predictor)
    last = 1.0 - new_plan_share(config, predictor)
    assert 0.0 < last < 2 / 3
    for other in (0.8 * last, 1.2 * last, 2 / 3):
        assert cooperative_radius(cooperative(small, damping=other), predictor) > automatic


def test_too_little_of_the_last_plan_is_refused(small: Config, linear_team: Team) -> None:
    config = cooperative(small, damping=0.01)
    plant = replace(config, controller=replace(config.controller, ki_z=0.0))
    meta = replace(PredictorMeta.of(plant), ridge=1e-9, block_weight=1.0)
    exact = fit_ridge([linear_team(3).episode(2500, 1)], meta)
    alike = exact.G.copy()
    for i in range(3):
        for j in range(3):
            alike[0, i, j, :, meta.layout.past :] = exact.G[0, j, j, :, meta.layout.past :]
    wild = Predictor(exact.meta, alike)
    assert cooperative_radius(plant, wild) > 1.0
    report = replace(
        run_gates(plant, exact, [linear_team(3).episode(200, 50)]),
        radius=cooperative_radius(plant, wild),
    )
    assert radius_limit(plant) == 1.0
    with pytest.raises(PredictorError, match=r"cooperative map.*below 1.*planner\.damping"):
        report.check(plant)
    assert cooperative_radius(cooperative(plant, damping=0.0), wild) < 1.0


def small_own(config: Config) -> Config:
    return replace(config, planner=replace(config.planner, cost="own"))


def test_who_has_no_peers_minimises_its_own_cost(small: Config) -> None:
    assert is_cooperative(cooperative(small))
    assert not is_cooperative(cooperative(small, robots=1))
    assert not is_cooperative(cooperative(small, kind="decentralised"))


def test_those_matter_who_reach_a_neighbour(small: Config) -> None:
    """In a chain of four whose ends know nothing of each other."""
    config = cooperative(small, robots=4)
    meta = replace(PredictorMeta.of(config), yokes="chain", neighbours="yoked")
    predictor = Predictor(meta, coupled(config, 1, 0.5).G)

    def peers(asked: Config) -> list[list[int]]:
        return [sorted(coupled_peers(asked, i, predictor)) for i in range(4)]

    assert peers(config) == [[1, 2], [0, 2, 3], [0, 1, 3], [1, 2]]
    assert peers(small_own(config)) == [[1], [0, 2], [1, 3], [2]]
    assert peers(cooperative(small, robots=4, kind="decentralised")) == [[]] * 4


def test_the_peers_terms_are_the_effect_of_their_plans_and_its_slope(
    small: Config, linear_team: Callable[..., Any]
) -> None:
    config = cooperative(small)
    meta = replace(PredictorMeta.of(config), ridge=1e-10, block_weight=1.0)
    predictor = fit_ridge([linear_team(3).episode(2500, 1)], meta)
    planner = Planner(config, 0, predictor)
    base = np.tile(BASE, (small.planner.T_ini, 1))
    stance = np.repeat(horizon_stance(config, 1, STEP), 3, axis=1)
    pushing = np.where(stance, np.tile([20.0, 5.0, 0.0], (8, 4)), 0.0)
    pair = peer(config, age=1, du=pushing), peer(config, robot="r3", index=2)
    terms = Peers(config, 0, predictor).terms(pair, STEP, STEP, base)
    z = np.zeros((3, predictor.meta.layout.width))
    z[1, predictor.meta.layout.past :] = pushing.ravel()
    effect = predictor.predict(z)
    qp = planner.problem_of(PlannerState(), inputs_of(config), terms)
    assert qp is not None
    columns, Q = qp.problem.columns, np.tile(config.planner.Q, config.planner.N)
    blocks = [predictor.future_block(j, 0)[:, columns] for j in range(3)]
    slope = sum(block.T @ (Q * effect[j]) for j, block in enumerate(blocks))
    np.testing.assert_allclose(terms.effect, effect[0], atol=1e-6 * np.abs(effect).max())
    np.testing.assert_allclose(terms.slope, slope, rtol=1e-4, atol=1e-4)


# ---- damping of best responses


def share(robots: int, **planner: object) -> float:
    keys = {"team.robots": robots, **{f"planner.{k}": v for k, v in planner.items()}}
    return kept_share(load(overrides=keys))


@given(st.integers(3, 10))
def test_it_is_the_fastest_for_robots_alike_with_half_their_own_effect_on_each_other(
    n: int,
) -> None:
    """The map of n such robots is −c (1 1ᵀ − I); damped, its radius is least at this share."""
    alike = -0.5 * (np.ones((n, n)) - np.eye(n))
    eigenvalues = np.linalg.eigvalsh(alike)
    candidates = np.linspace(0.0, 0.99, 991)
    radii = [np.abs(d + (1.0 - d) * eigenvalues).max() for d in candidates]
    best = candidates[int(np.argmin(radii))]
    assert share(n, preset="fast") == pytest.approx(best, abs=1e-3)
    assert min(radii) < 1.0


def test_few_robots_are_damped_only_if_they_are_asked_to_be() -> None:
    shares = {(1, "usual"): 0.0, (3, "usual"): 0.0, (4, "usual"): 1 / 3, (2, "fast"): 0.0,
              (3, "fast"): 0.2, (10, "paper"): 0.0}  # fmt: skip
    found = {key: share(key[0], preset=key[1]) for key in shares}
    assert found == pytest.approx(shares)
    assert (share(10, damping=0.0), share(2, damping=0.3)) == (0.0, 0.3)
    with pytest.raises(ConfigError, match=r"planner.damping: got -0.5, expected -1, or 0 … 0.95"):
        share(5, damping=-0.5)


def test_who_answers_nobody_is_damped_only_if_it_is_asked_to() -> None:
    kinds = ("distributed", "decentralised")
    teams = [load(overrides={"team.robots": 5, "planner.kind": kind}) for kind in kinds]
    assert [kept_share(team) for team in teams] == [pytest.approx(3 / 7), 0.0]
    asked = load(overrides={"planner.kind": "decentralised", "planner.damping": 0.4})
    assert kept_share(asked) == 0.4
