"""The distributed planner on a team whose response is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from agents.gait import nominal_forces
from agents.planner.fits import fit_ridge
from agents.planner.horizon import horizon_stance, walking_steps
from agents.planner.neighbours import HELD, LOST, PeerData, Selection
from agents.planner.peer_terms import PeerTerms
from agents.planner.planner import Planner, PlannerInputs, PlannerState, PlanResult
from agents.planner.predictor import Predictor, PredictorMeta
from shared.config import Config
from shared.errors import PredictorError
from shared.robot import Array

Team = Callable[..., Any]
BASE = np.array([0.26, 0.4, 0.0, 0.0, 0.0, 0.1])
STEP = 20
NOTHING = PeerTerms()


@pytest.fixture(scope="module")
def predictor(small: Config, linear_team: Team) -> Predictor:
    meta = replace(PredictorMeta.of(small), ridge=1e-10, block_weight=1.0)
    return fit_ridge([linear_team(2).episode(1500, 1)], meta)


def peer(config: Config, **changes: Any) -> PeerData:
    """A peer that did and plans nothing, with changes."""
    quiet = PeerData(
        robot="r2", index=1, status="fresh", step=STEP - 1, age=0,
        known=np.ones(config.planner.T_ini, dtype=np.bool_),
        du_ini=np.zeros((config.planner.T_ini, 12)),
        y_ini=np.tile(BASE, (config.planner.T_ini, 1)),
        du=np.zeros((config.planner.N, 12)),
    )  # fmt: skip
    return replace(quiet, **changes)


def inputs_of(config: Config, step: int = STEP, **changes: Any) -> PlannerInputs:
    """A robot that walks exactly as commanded, with changes."""
    planner = config.planner
    stance = np.ones((planner.T_ini, 4), dtype=np.bool_)
    calm = PlannerInputs(
        step=step,
        u_ini=nominal_forces(stance),
        y_ini=np.tile(BASE, (planner.T_ini, 1)),
        stance_ini=stance,
        y_base_ini=np.tile(BASE, (planner.T_ini, 1)),
        y_base=np.tile(BASE, (planner.N, 1)),
        y_des=np.tile(BASE, (planner.N, 1)),
    )
    return replace(calm, **changes)


def terms_of(
    config: Config, planner: Planner, *peers: PeerData, before: PeerTerms = NOTHING,
    base: Array | None = None,
) -> PeerTerms:  # fmt: skip
    """Terms of the peers given, by default of one that did and plans nothing."""
    y_base = np.tile(BASE, (config.planner.T_ini, 1)) if base is None else base
    return planner.peer_terms(before, Selection(peers or (peer(config),)), STEP, y_base)


def plan(
    config: Config, predictor: Predictor, inputs: PlannerInputs, *peers: PeerData,
    base: Array | None = None,
) -> PlanResult:  # fmt: skip
    planner = Planner(config, 0, predictor)
    terms = terms_of(config, planner, *peers, base=base)
    return planner.step(planner.initial(), inputs, terms)[1]


def test_at_rest_on_the_command_the_plan_is_nominal(small: Config, predictor: Predictor) -> None:
    result = plan(small, predictor, inputs_of(small))
    nominal = nominal_forces(horizon_stance(small, 0, STEP))
    assert result.status == "solved"
    np.testing.assert_allclose(result.u, nominal, atol=1e-9)
    np.testing.assert_allclose(result.y, np.tile(BASE, (8, 1)), atol=1e-9)
    assert result.used == {"r2": STEP - 1}


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


def test_the_plan_brings_the_robot_back(small: Config, predictor: Predictor) -> None:
    """Too slow and too low: forces forward and up, and closer to the wish than doing nothing."""
    wish = np.tile(BASE + np.array([0.004, 0.05, 0.0, 0.0, 0.0, 0.0]), (8, 1))
    result = plan(small, predictor, inputs_of(small, y_des=wish))
    forces = result.du.reshape(8, 4, 3).sum(axis=1)
    assert forces[:4, 0].min() > 1.0
    assert forces[:4, 2].min() > 1.0
    assert (np.abs(result.y - wish)[-1, :2] < np.abs(BASE - wish[-1])[:2]).all()


def test_swing_legs_carry_exactly_nothing(small: Config, predictor: Predictor) -> None:
    wish = np.tile(BASE + 0.02, (8, 1))
    for step in range(30):
        result = plan(small, predictor, inputs_of(small, step=step, y_des=wish))
        swing = ~horizon_stance(small, 0, step)
        assert (result.u.reshape(8, 4, 3)[swing] == 0.0).all()


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


def test_a_silent_peers_terms_are_held_then_it_is_lost(small: Config, predictor: Predictor) -> None:
    planner, inputs = Planner(small, 0, predictor), inputs_of(small)
    push = np.tile([20.0, 0.0, 0.0], (8, 4))
    heard = terms_of(small, planner, peer(small, du=push))
    state, before = planner.step(planner.initial(), inputs, heard)
    assert np.abs(before.du).max() > 0.01
    silent = peer(small, status=HELD, step=STEP - 5, age=4)
    held = terms_of(small, planner, silent, before=heard)
    state, during = planner.step(state, inputs, held)
    np.testing.assert_array_equal(during.u, before.u)
    assert during.used == {"r2": STEP - 5}
    gone = peer(small, status=LOST, step=STEP - 9, age=8)
    state, after = planner.step(state, inputs, terms_of(small, planner, gone, before=held))
    assert after.status == "nominal:peer-lost"
    assert after.lost == ("r2",)
    np.testing.assert_array_equal(after.u, nominal_forces(horizon_stance(small, 0, STEP)))
    assert state.solves == 2


def test_a_silent_peers_effect_is_held_while_the_legs_change(
    small: Config, predictor: Predictor, linear_team: Team
) -> None:
    """Whichever legs its schedule has standing later; what another does adds to it."""
    three = replace(small, team=replace(small.team, robots=3))
    meta = replace(PredictorMeta.of(three), ridge=1e-10, block_weight=1.0)
    planner = Planner(three, 0, fit_ridge([linear_team(3).episode(2500, 1)], meta))
    base = np.tile(BASE, (small.planner.T_ini, 1))
    stance = np.repeat(horizon_stance(three, 1, STEP - 1), 3, axis=1)
    talking = peer(three, du=np.where(stance, np.tile([20.0, 5.0, 0.0], (8, 4)), 0.0))
    third = peer(three, robot="r3", index=2)

    def terms(step: int, before: PeerTerms, *peers: PeerData) -> PeerTerms:
        return planner.peer_terms(before, Selection(peers, step - 1), step, base)

    heard = terms(STEP, NOTHING, talking, third)
    now = heard
    assert np.abs(heard.effect).max() > 1e-3
    for step in range(STEP + 1, STEP + 9):
        silent = peer(three, status=HELD, step=STEP - 1, age=step - STEP)
        now = terms(step, now, silent, third)
        np.testing.assert_allclose(now.effect, heard.effect, atol=1e-7)
    pushing = replace(third, y_ini=third.y_ini + 0.01)
    alone = terms(STEP + 9, NOTHING, peer(three), pushing)
    both = terms(STEP + 9, now, silent, pushing)
    np.testing.assert_allclose(both.effect, heard.effect + alone.effect, atol=1e-7)
    again = terms(STEP + 10, now, peer(three), third)
    np.testing.assert_allclose(again.effect, 0.0, atol=1e-7)


@pytest.mark.parametrize(
    ("changes", "behind"),
    [({}, (1,)), ({"compensation": True}, (0,)), ({"exchanges": 2}, (1, 0))],
    ids=["plain", "compensated", "exchanging"],
)
def test_on_the_way_nothing_is_set_up_any_more(
    small: Config, predictor: Predictor, monkeypatch: pytest.MonkeyPatch,
    changes: dict[str, Any], behind: tuple[int, ...],
) -> None:  # fmt: skip
    config = replace(small, planner=replace(small.planner, **changes))
    planner = Planner(config, 0, predictor)
    monkeypatch.setattr("agents.planner.peer_terms.Coupling", None)
    monkeypatch.setattr("agents.planner.planner.build_problem", None)
    base, state, terms = np.tile(BASE, (4, 1)), planner.initial(), NOTHING
    first = walking_steps(config).start
    for step in range(first, first + 3 * len(walking_steps(config))):
        for steps in behind:
            terms = planner.peer_terms(terms, Selection((peer(config),), step - steps), step, base)
            state, _ = planner.step(state, inputs_of(config, step), terms)


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


def test_a_broken_measurement_gives_nominal_forces(small: Config, predictor: Predictor) -> None:
    broken = np.tile(BASE, (4, 1))
    broken[2, 1] = np.nan
    result = plan(small, predictor, inputs_of(small, y_ini=broken))
    assert result.status == "nominal:not-finite"
    np.testing.assert_array_equal(result.u, nominal_forces(horizon_stance(small, 0, STEP)))


@pytest.mark.parametrize(
    ("absurd", "status"),
    [(np.nan, "not-finite"), (np.inf, "not-finite"), (1e170, "not-finite"), (1e6, "implausible")],
)
def test_a_plan_is_finite_and_within_reach_whatever_was_measured(
    small: Config, predictor: Predictor, absurd: float, status: str
) -> None:
    broken = np.tile(BASE, (4, 1))
    broken[2, 1] = absurd
    wish = np.tile(BASE + 0.01, (8, 1))
    result = plan(small, predictor, inputs_of(small, y_ini=broken, y_des=wish))
    assert result.status == f"nominal:{status}"
    np.testing.assert_array_equal(result.u, nominal_forces(horizon_stance(small, 0, STEP)))
    assert not result.du.any()
    for outputs in (result.y, result.y_nominal):
        np.testing.assert_array_equal(outputs, wish)


def test_equal_inputs_give_equal_bits_whatever_came_before(
    small: Config, predictor: Predictor
) -> None:
    rng = np.random.default_rng(5)
    various = [
        inputs_of(small, step=int(step), y_ini=BASE + 0.01 * rng.normal(size=(4, 6)))
        for step in rng.integers(8, 28, 12)
    ]
    used = Planner(small, 0, predictor)
    first = [used.step(used.initial(), one, NOTHING)[1] for one in various]
    for one, expected in reversed(list(zip(various, first, strict=True))):
        for planner in (used, Planner(small, 0, predictor)):
            again = planner.step(planner.initial(), one, NOTHING)[1]
            assert again.u.tobytes() == expected.u.tobytes()
            assert again.y.tobytes() == expected.y.tobytes()


def closed_loop(config: Config, predictor: Predictor, team: Any, x: Array, steps: int) -> Array:
    """Every robot plans, the delay protocol with no losses, the first samples act. (T, n, 6)."""
    n, applied, T_ini = config.team.robots, config.planner.applied, config.planner.T_ini
    planners = [Planner(config, i, predictor) for i in range(n)]
    du, y = [np.zeros((n, 12))] * (T_ini + applied), [np.tile(BASE, (n, 1))] * (T_ini + applied)
    before = [np.zeros((config.planner.N, 12))] * n
    for step in range(STEP, STEP + steps):
        u_past, y_past = np.array(du[-T_ini - applied :]), np.array(y[-T_ini - applied :])
        data = [
            peer(config, robot=f"r{j + 1}", index=j, step=step - 1, du_ini=u_past[:T_ini, j],
                 y_ini=y_past[:T_ini, j], du=before[j])
            for j in range(n)
        ]  # fmt: skip
        results = []
        for i, planner in enumerate(planners):
            own = inputs_of(
                config, step=step, y_ini=y_past[applied:, i],
                u_ini=u_past[applied:, i],
                stance_ini=np.ones((T_ini, 4), dtype=np.bool_),
            )  # fmt: skip
            own = replace(own, u_ini=own.u_ini + nominal_forces(own.stance_ini))
            terms = terms_of(config, planner, *data[:i], *data[i + 1 :])
            results.append(planner.step(planner.initial(), own, terms)[1])
        before = [result.du for result in results]
        for k in range(applied):
            du.append(np.array([result.du[k] for result in results]))
            x = team.A @ x + team.B @ du[-1].ravel()
            y.append(BASE + (team.C @ x).reshape(n, 6))
    return np.array(y)


def test_a_distributed_team_recovers_sooner_than_without_plans(
    small: Config, predictor: Predictor, linear_team: Team
) -> None:
    team = linear_team(2)
    x = np.zeros(18)
    x[[2, 3, 9 + 2, 9 + 4]] = 0.3, 0.1, -0.2, 0.05
    planned = closed_loop(small, predictor, team, x, steps=6) - BASE
    idle = team.respond(np.zeros((24, 2, 12)), x)
    # The first plan knows nothing of x yet, so its four samples are the same.
    assert np.abs(planned[-20:, :, 1]).sum() < 0.5 * np.abs(idle[4:, :, 1]).sum()
    assert np.abs(planned[-4:]).max() < 0.5 * np.abs(idle[-4:]).max()


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
    state = PlannerState(STEP - 1, last, 1)
    _, free = undamped.step(state, inputs, NOTHING)
    _, mixed = planner.step(state, inputs, NOTHING)
    forward = np.zeros((8, 12))
    forward[:4] = last[4:]
    np.testing.assert_allclose(mixed.du, (1 - share) * free.du + share * forward, atol=1e-9)
    _, again = planner.step(PlannerState(STEP, free.du, 1), inputs, NOTHING)
    np.testing.assert_allclose(again.du, free.du, atol=1e-9)
    effect = predictor.forced(0, 0) @ (mixed.du - free.du).ravel()
    np.testing.assert_allclose(mixed.y - free.y, effect.reshape(8, 6), atol=1e-9)


@pytest.mark.parametrize("kind", ["soft", "hard"])
def test_output_bounds_are_kept(small: Config, predictor: Predictor, kind: str) -> None:
    """Pulled towards a speed beyond the bound, the plan stops at it; softly a little beyond."""
    wish = np.tile(BASE, (8, 1))
    start = np.tile(BASE + np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0]), (4, 1))
    inputs = inputs_of(small, y_ini=start, y_des=wish)
    free = plan(small, predictor, inputs).y - wish
    limit = 0.8 * float(np.abs(free[3:, 1]).max())
    far = (10.0, limit, 10.0, 10.0, 10.0, 10.0)
    planner = replace(small.planner, output_bounds=kind, output_max=far, deviation_max=(1e3,) * 3)
    bounded = plan(replace(small, planner=planner), predictor, inputs)
    excess = np.abs(bounded.y - wish)[:, 1].max() - limit
    assert np.abs(free[:, 1]).max() > limit
    if kind == "hard":
        assert bounded.status in ("solved", "nominal:infeasible")
        assert bounded.status == "nominal:infeasible" or excess < 1e-6
    else:
        assert bounded.status == "solved"
        assert excess < 0.3 * (np.abs(free[:, 1]).max() - limit)
