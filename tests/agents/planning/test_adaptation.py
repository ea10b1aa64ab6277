"""An agent that corrects its own block of the predictor by what it measures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from quadriga.agents.gait import scheduled_stance
from quadriga.agents.modes import WALK, Mode
from quadriga.agents.planning.adaptation import Adapter
from quadriga.agents.planning.interface import PlanningInputs
from quadriga.agents.planning.local import LocalPlanning, LocalState
from quadriga.agents.predictor.recursive import Correction
from quadriga.shared.config.sections import Config, TeamConfig
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Measurement
from tests.a1 import nominal_forces
from tests.agents.duet import asked, simple_predictor

ALONE = Config(team=TeamConfig(robots=1))
ADAPTING = replace(ALONE, planner=replace(ALONE.planner, adaptation="recursive"))
PREDICTOR = simple_predictor(ALONE)
COURSE = np.array([0.26, 0.3, 0.0, 0.0, 0.0, 0.0])
FORGET = np.exp(-0.2)  # of the predictor's plant, per sample


def walk(samples: int, strength: float, seed: int = 0) -> list[Measurement]:
    """The predictor's plant, its forces acting with `strength`, under random forces."""
    effect = np.zeros((6, 12))
    for leg in range(4):
        effect[0, 3 * leg + 2], effect[1, 3 * leg], effect[2, 3 * leg + 1] = 2e-5, 8e-4, 8e-4
    rng, y = np.random.default_rng(seed), np.zeros(6)
    made = []
    for tick in range(310, 310 + 10 * samples, 10):
        stance = scheduled_stance(ALONE, 0, np.array([tick - 10]))[0]
        du = rng.normal(size=12) * np.tile([15.0, 15.0, 35.0], 4) * np.repeat(stance, 3)
        y = FORGET * y + strength * effect @ du
        u = nominal_forces(stance) + du
        made.append(Measurement(tick, 0, u, COURSE + y, stance.astype(float)))
    return made


def errors(G: Array, samples: list[Measurement]) -> float:
    """RMS error of predictions with a block G_ii over all windows of a walk, scaled by 5 mm."""
    T_ini, N = ALONE.planner.T_ini, ALONE.planner.N
    stance = np.array([s.stance for s in samples]) > 0.5
    du = np.array([s.u for s in samples]) - nominal_forces(stance)
    dy = np.array([s.y for s in samples]) - COURSE
    found = []
    for k in range(len(samples) - T_ini - N):
        past, ahead = slice(k, k + T_ini), slice(k + T_ini, k + T_ini + N)
        z = np.concatenate([du[past].ravel(), dy[past].ravel(), du[ahead].ravel()])
        found.append(G @ z - dy[ahead].ravel())
    return float(np.sqrt(np.mean(np.square(found))))


def learnt(strength: float, windows: int) -> tuple[Adapter, Correction]:
    """What an adapter knows after every fourth window of a walk."""
    adapter = Adapter(ADAPTING, 0, PREDICTOR)
    samples = walk(adapter.samples + 4 * windows, strength)
    base, state = np.tile(COURSE, (adapter.samples, 1)), None
    for k in range(0, 4 * windows, 4):
        state = adapter.learn(state, tuple(samples[k : k + adapter.samples]), base)
    assert state is not None
    return adapter, state


def test_forces_that_act_more_weakly_than_in_the_data_are_learnt_by_and_by() -> None:
    """480 unknowns an output: half a minute of walking takes away a third of the error."""
    other = walk(150, 0.6, seed=1)
    adapter, early = learnt(0.6, 250)
    _, late = learnt(0.6, 750)
    blocks = (PREDICTOR.block(0, 0), adapter.block(early, 0), adapter.block(late, 0))
    never, soon, later = (errors(G, other) for G in blocks)
    assert (early.updates, late.updates) == (250, 750)
    assert later < soon < never
    assert later < 0.75 * never


def test_a_plant_that_is_as_predicted_is_left_alone() -> None:
    adapter, state = learnt(1.0, 60)
    np.testing.assert_allclose(adapter.block(state, 0), PREDICTOR.block(0, 0), atol=1e-9)


def walk_with(config: Config, samples: list[Measurement]) -> tuple[LocalState, list[Array]]:
    """A planning part on a walk: its state and its plans' forces."""
    planning, plans = LocalPlanning(config, 0, PREDICTOR, lambda: 0), []
    state = planning.initial()
    for sample in samples:
        arrived = PlanningInputs(sample.tick, Mode(WALK, 300), (asked(0.3),), sample)
        state, outputs = planning.step(state, arrived)
        if outputs.plan is not None:
            assert outputs.plan.status in ("solved", "faded")
            plans.append(outputs.plan.u)
    return state, plans


def test_an_agent_learns_at_every_step_whose_window_is_whole_and_plans_otherwise_then() -> None:
    samples = walk(75, 0.6)
    fixed, plain = walk_with(ALONE, samples)
    adapted, learning = walk_with(ADAPTING, samples)
    assert fixed.correction is None
    assert adapted.correction is not None
    whole = [s.tick for s in samples[34:] if s.tick % 40 == 0]
    assert adapted.correction.updates == len(whole)
    early = len(plain) - len(whole)
    for one, other in zip(plain[:early], learning[:early], strict=True):
        np.testing.assert_array_equal(one, other)
    assert np.abs(plain[-1] - learning[-1]).max() > 1e-3
    _, again = walk_with(ADAPTING, samples)
    assert [u.tobytes() for u in again] == [u.tobytes() for u in learning]


def test_a_gap_in_the_samples_teaches_nothing_until_it_has_passed() -> None:
    samples = walk(100, 0.6)
    state, _ = walk_with(ADAPTING, samples[:60] + samples[61:])
    whole = [s.tick for s in samples[34:60] if s.tick % 40 == 0]
    later = [s.tick for s in samples[61 + 34 :] if s.tick % 40 == 0]
    assert state.correction is not None
    assert state.correction.updates == len(whole) + len(later)


@pytest.mark.parametrize("absurd", [1e4, 1e170, np.nan])
@pytest.mark.parametrize("name", ["u", "y"])
def test_a_sample_that_no_robot_can_mean_is_not_learnt_from(absurd: float, name: str) -> None:
    samples, base = walk(35, 0.6), np.tile(COURSE, (35, 1))
    adapter, known = learnt(0.6, 10)
    broken = getattr(samples[7], name).copy()
    broken[3] = absurd
    wrong = replace(samples[7], **{name: broken})
    for before in (None, known):
        after = adapter.learn(before, (*samples[:7], wrong, *samples[8:]), base)
        assert (after.updates, after.refused) == (0 if before is None else 10, 1)
        np.testing.assert_array_equal(after.D, 0.0 if before is None else known.D)


def test_without_a_finite_correction_the_predictors_own_part_counts() -> None:
    """And windows with an absurd sample are counted as long as it is among the last 35."""
    samples = walk(75, 0.6)
    state, _ = walk_with(ADAPTING, samples[:62])
    assert state.correction is not None
    spoilt = replace(
        state, correction=replace(state.correction, D=np.full_like(state.correction.D, np.inf))
    )
    wrong = replace(samples[62], u=np.full(12, 1e6))
    plans = []
    for config, start in ((ADAPTING, spoilt), (ALONE, state)):
        planning = LocalPlanning(config, 0, PREDICTOR, lambda: 0)
        for sample in (wrong, *samples[63:66]):
            arrived = PlanningInputs(sample.tick, Mode(WALK, 300), (asked(0.3),), sample)
            start, outputs = planning.step(start, arrived)
        assert outputs.plan is not None
        assert outputs.unusual == (("window_not_learnt",) if config is ADAPTING else ())
        plans.append(outputs.plan)
    np.testing.assert_array_equal(plans[0].u, plans[1].u)
