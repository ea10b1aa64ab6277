"""The periodic fit against plants whose response at every phase is known, and its parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.gait import gait_phase, nominal_forces, scheduled_stance
from quadriga.agents.predictor.episode import Y_SCALE, Episode, wrench_map
from quadriga.agents.predictor.gates import coupling_table, held_out_error
from quadriga.agents.predictor.periodic import PeriodicFactors, polynomials
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta, fit, fit_plant
from quadriga.agents.predictor.store import load, predictor_sha256, save
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.arithmetic import use_one_blas_thread

N, T_INI = 8, 4
CONFIG = replace(Config(), planner=replace(Config().planner, N=N, T_ini=T_INI))
VX, VY, ROLL = 1, 2, 3  # outputs that peers have an effect on


@dataclass(frozen=True)
class Trotters:
    """Robots whose outputs forget at a rate and answer to wrenches by the gait's phase.

    y_t = a y_{t−1} + Σ_j b_ij(θ_t) w_j,t with b_ij = b⁰_ij + b¹_ij cos θ: h_l(θ) = a^l b(θ). Peers
    have an effect on `VX`, `VY` and `ROLL` alone, and none if they are not `coupled`.
    """

    robots: int
    coupled: tuple[tuple[int, int], ...]
    forgets: float = 0.85

    def gain(self, angle: float) -> Array:
        """B at a phase, (n, n, 6 outputs, 6 wrench components), scaled."""
        random, n = np.random.default_rng(5), self.robots
        mean, wave = random.normal(size=(2, n, n, 6, 6))
        b: Array = mean + 0.7 * wave * np.cos(angle)
        for i in range(n):
            for j in range(n):
                if i != j:
                    b[i, j] *= 0.5 if (i, j) in self.coupled else 0.0
                    b[i, j, [0, 4, 5]] = 0.0
        return b

    def respond(self, meta: PredictorMeta, du: Array, first_tick: int) -> Array:
        """Output deviations (T, n, 6) to force deviations (T, n, 12)."""
        w = du @ wrench_map(meta.robot).T
        angle, y = meta.period.angles(first_tick, len(du)), np.zeros((self.robots, 6))
        outputs = []
        for k, now in enumerate(w):
            y = self.forgets * y + np.einsum("ijow,jw->io", self.gain(angle[k]), now)
            outputs.append(y * Y_SCALE)
        return np.array(outputs)

    def episode(self, seed: int, samples: int, *, hold: int = 2, noise: float = 0.5) -> Episode:
        """A trot under force noise that is held for `hold` samples."""
        random, first_tick = np.random.default_rng(seed), CONFIG.gait.stand_ms + 10
        draws = random.normal(size=(-(-samples // hold), self.robots, 12))
        du = 15.0 * np.repeat(draws, hold, axis=0)[:samples]
        starts = first_tick - 10 + 10 * np.arange(samples)
        stance = np.stack([scheduled_stance(CONFIG, i, starts) for i in range(self.robots)], axis=1)
        du *= np.repeat(stance, 3, axis=2)
        y = self.respond(meta_of(self.robots), du, first_tick)
        y += noise * random.normal(size=y.shape) * Y_SCALE
        nominal = nominal_forces(stance, CONFIG.robot.weight)
        return Episode(nominal + du, nominal, y, np.zeros_like(y), first_tick)


def meta_of(robots: int, **changes: Any) -> PredictorMeta:
    config = replace(CONFIG, team=replace(CONFIG.team, robots=robots))
    return replace(PredictorMeta.of(config), kind="periodic", **changes)


def true_block(team: Trotters, meta: PredictorMeta, i: int, j: int, phase: int) -> Array:
    """The future block of G_ij, scaled outputs, from the closed form."""
    block, B = np.zeros((N, 6, N, 12)), wrench_map(meta.robot)
    for s in range(N):
        b = team.gain(2 * np.pi * (phase + s) / 40)[i, j] @ B
        for t in range(s, N):
            block[t, :, s] = team.forgets ** (t - s) * b
    truth: Array = block.reshape(6 * N, 12 * N) * stance_columns_of(j, phase)
    return truth


def found_block(predictor: Predictor, i: int, j: int, phase: int) -> Array:
    """The same of a predictor."""
    scaled = predictor.future_block(i, j, phase) / np.tile(Y_SCALE, N)[:, None]
    found: Array = scaled * stance_columns_of(j, phase)
    return found


def stance_columns_of(j: int, phase: int) -> Array:
    """1 for the forces of stance feet: no other ones are ever seen, or planned. (12 N,)."""
    starts = CONFIG.gait.stand_ms + 10 * (phase + np.arange(N))
    stands: Array = np.repeat(scheduled_stance(CONFIG, j, starts), 3, axis=1).astype(float)
    return stands.ravel()


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> None:
    use_one_blas_thread()


@pytest.fixture(scope="module")
def chain() -> Trotters:
    """Three robots; the first and the last know nothing of each other."""
    return Trotters(3, ((0, 1), (1, 0), (1, 2), (2, 1)))


@pytest.fixture(scope="module")
def fitted(chain: Trotters) -> Predictor:
    return fit([chain.episode(seed, 4000) for seed in (1, 2)], meta_of(3))


def test_the_response_at_every_phase_is_the_true_one(chain: Trotters, fitted: Predictor) -> None:
    for i, j in ((0, 0), (1, 1), (2, 2), *chain.coupled):
        truth = [true_block(chain, fitted.meta, i, j, phase) for phase in range(0, 40, 4)]
        found = [found_block(fitted, i, j, phase) for phase in range(0, 40, 4)]
        error = np.linalg.norm(np.array(found) - truth) / np.linalg.norm(truth)
        assert error < (0.12 if i == j else 0.25)


def test_what_has_no_effect_has_exactly_none(chain: Trotters, fitted: Predictor) -> None:
    """Other robots, other outputs, and forces of later samples: none acts backwards."""
    for i in range(3):
        for j in range(3):
            block = fitted.future_block(i, j, 7).reshape(N, 6, -1)
            has_effect = np.any(block, axis=(0, 2))
            by_sample = np.any(block.reshape(N, 6, N, 12), axis=(1, 3))
            assert not np.triu(by_sample, 1).any()
            if i == j:
                assert has_effect.all()
            elif (i, j) in chain.coupled:
                assert np.flatnonzero(has_effect).tolist() == [VX, VY, ROLL]
            else:
                assert not has_effect.any()


def test_held_out_data_are_predicted_up_to_their_noise(chain: Trotters, fitted: Predictor) -> None:
    exact = chain.episode(9, 600, noise=0.0)
    rmse, _, _ = held_out_error(fitted, [exact])
    forgetful = np.sqrt(np.mean(exact.y**2, axis=(0, 1)))
    assert (np.sqrt((rmse**2).mean(axis=0)) < 0.3 * forgetful).all()


def test_strangers_are_left_out_if_only_yoked_robots_count() -> None:
    everyone = tuple((i, j) for i in range(3) for j in range(3) if i != j)
    team, meta = Trotters(3, everyone), meta_of(3, yokes="chain", neighbours="yoked")
    predictor = fit([team.episode(4, 2000)], meta)
    for i in range(3):
        for j in range(3):
            assert predictor.G[:, i, j].any() == (abs(i - j) <= 1)
            assert predictor.block(i, j, 3).any() == (abs(i - j) <= 1)


def test_blocks_rows_and_the_whole_of_G_are_the_same(fitted: Predictor) -> None:
    G, layout = fitted.G, fitted.layout
    assert G.shape == (40, 3, 3, 6 * N, layout.width)
    z = np.random.default_rng(0).normal(size=(3, layout.width))
    for phase in (0, 21):
        expected = np.einsum("ijab,jb->ia", G[phase], z)
        np.testing.assert_allclose(fitted.predict(z, phase), expected, rtol=1e-9)
        np.testing.assert_array_equal(
            fitted.future_block(2, 1, phase), G[phase, 2, 1][:, layout.past :]
        )
    # A few megabytes of factors stand for what would be many times as large.
    assert sum(array.nbytes for array in fitted.arrays().values()) < 0.2 * G.nbytes
    table = coupling_table(fitted)
    assert table.shape == (3, 3)
    assert not table[[0, 2], [2, 0]].any()


def test_what_is_saved_is_read_and_what_is_wrong_refused(tmp_path: Path, fitted: Predictor) -> None:
    digest = save(tmp_path / "periodic.npz", fitted)
    again, _ = load(tmp_path / "periodic.npz")
    assert isinstance(again.parts, PeriodicFactors)
    assert predictor_sha256(again) == digest
    np.testing.assert_array_equal(again.block(1, 2, 17), fitted.block(1, 2, 17))
    with pytest.raises(PredictorError, match=r"arrays of \(3,\) agents, expected 2"):
        Predictor(meta_of(2), fitted.parts)
    with pytest.raises(PredictorError, match="data for the periodic predictor"):
        fit([Trotters(1, ()).episode(1, 16)], meta_of(1))


# ---- a plant that is no team

PERIOD, PAST, HORIZON, FORGETS = 20, 3, 6, 0.8
# Three inputs act by two numbers on each of two agents; agent 1 feels agent 0.
ACTIONS = np.array([[1.0, -1.0, 0.0], [0.5, 0.5, 2.0]])


def gain(place: float) -> Array:
    """From the actions of all agents to the outputs of all, at a place in the period."""
    wave = np.cos(2 * np.pi * place / PERIOD)
    own = np.array([[1.0 + 0.6 * wave, 0.2], [-0.3, 0.8 - 0.5 * wave]])
    across = np.array([[0.6, 0.0], [0.3 * wave, 0.5]])
    return np.block([[own, np.zeros((2, 2))], [across, own]])


def record(seed: int, samples: int, begin: int, hold: int, unit: float) -> Episode:
    """y_k = 0.8 y_{k−1} + gain(k) w_k under random inputs in some unit, with noise."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(size=(samples // hold, 2, 3)), hold, axis=0)
    outputs, y = [], np.zeros(4)
    for k, now in enumerate(u):
        y = FORGETS * y + gain(begin + k) @ (now @ ACTIONS.T).ravel()
        outputs.append(y.reshape(2, 2) + 0.05 * rng.normal(size=(2, 2)))
    return Episode.of(unit * u, outputs, begin)


@pytest.mark.parametrize(("hold", "unit"), [(1, 1.0), (2, 100.0)])
def test_the_response_of_any_plant_is_found_at_every_phase(hold: int, unit: float) -> None:
    data, unseen = record(1, 3000, 7, hold, unit), record(2, 400, 3, 1, unit)
    predictor = fit_plant([data], "periodic", PAST, HORIZON, period=PERIOD, input_map=ACTIONS)
    assert predictor.phases == PERIOD
    timeless = fit_plant([data], "ridge", PAST, HORIZON)
    assert held_out_error(predictor, [unseen])[2] < 0.5 * held_out_error(timeless, [unseen])[2]
    assert not predictor.G[:, 0, 1].any(), "agent 1 does nothing to agent 0"
    for phase in (0, 13):
        forced = unit * predictor.future_block(1, 0, phase).reshape(HORIZON, 2, HORIZON, 3)
        true = np.zeros_like(forced)
        for s in range(HORIZON):
            for t in range(s, HORIZON):
                true[t, :, s] = FORGETS ** (t - s) * gain(phase + s)[2:, :2] @ ACTIONS
        assert np.linalg.norm(forced - true) < 0.2 * np.linalg.norm(true)
    # The horizon begins with sample 3 + 40 of this episode.
    past, ahead = slice(40 - PAST, 40), slice(40, 40 + HORIZON)
    u, y = unseen.u, unseen.y
    forecast = predictor.forecast(u[past], y[past], u[ahead], phase=43)
    assert np.abs(forecast - y[ahead]).max() < 0.5 < np.abs(y[ahead]).max()


# ---- parts


def test_a_half_begins_where_the_feet_change_whatever_the_rounding() -> None:
    """Phases 0 and 20 of 40, and those of later periods."""
    phases = np.array([0, 20, 40, 60, 80, 100, 119, 120])
    first = polynomials(2 * np.pi * phases / 40, 0)[:, 0] > 0.0
    assert first.tolist() == [True, False, True, False, True, False, False, True]


def test_a_samples_angle_is_that_of_the_phase_it_begins_in() -> None:
    """Sample 0 ends at `first_tick`; a plan at tick t begins with the sample after it."""
    meta = meta_of(1)
    for k, angle in enumerate(meta.period.angles(first_tick=1010, count=100)):
        phase = gait_phase(1000 + 10 * k, meta.stand_ms, meta.stance_ms, 40)
        assert angle == pytest.approx(2 * np.pi * phase / 40)
    assert meta.period.angle_step == pytest.approx(2 * np.pi / 40)
