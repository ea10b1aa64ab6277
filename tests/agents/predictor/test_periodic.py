"""The periodic fit against a team whose response to every wrench at every phase is known."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadriga.agents.gait import nominal_forces, scheduled_stance
from quadriga.agents.planner.acceptance import run_gates
from quadriga.agents.predictor.episode import Y_SCALE, Episode, wrench_map
from quadriga.agents.predictor.fits import fit, fit_periodic, phase_angles
from quadriga.agents.predictor.gates import coupling_table, held_out_error
from quadriga.agents.predictor.periodic import PeriodicFactors
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, predictor_sha256, read, save, versions
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
        angle, y = phase_angles(meta, first_tick, len(du)), np.zeros((self.robots, 6))
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
        meta = meta_of(self.robots)
        y = self.respond(meta, du, first_tick)
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
    return fit_periodic([chain.episode(seed, 4000) for seed in (1, 2)], meta_of(3))


@pytest.fixture
def provenance(chain: Trotters, fitted: Predictor) -> Provenance:
    config = replace(CONFIG, team=replace(CONFIG.team, robots=3))
    gates = run_gates(config, fitted, [chain.episode(8, 100)])
    return Provenance("abc", (1,), (4000,), (100,), versions(), gates)


def test_the_response_at_every_phase_is_the_true_one(chain: Trotters, fitted: Predictor) -> None:
    for i, j in ((0, 0), (1, 1), (2, 2), *chain.coupled):
        truth = [true_block(chain, fitted.meta, i, j, phase) for phase in range(0, 40, 4)]
        found = [found_block(fitted, i, j, phase) for phase in range(0, 40, 4)]
        error = np.linalg.norm(np.array(found) - truth) / np.linalg.norm(truth)
        assert error < (0.12 if i == j else 0.25)


def test_peers_that_have_no_effect_have_exactly_none(chain: Trotters, fitted: Predictor) -> None:
    for i in range(3):
        for j in range(3):
            block = fitted.future_block(i, j, 7).reshape(N, 6, -1)
            has_effect = np.any(block, axis=(0, 2))
            if i == j:
                assert has_effect.all()
            elif (i, j) in chain.coupled:
                assert np.flatnonzero(has_effect).tolist() == [VX, VY, ROLL]
            else:
                assert not has_effect.any()


def test_no_force_acts_backwards(fitted: Predictor) -> None:
    for phase in (0, 13):
        block = fitted.future_block(1, 0, phase).reshape(N, 6, N, 12)
        for t in range(N):
            assert not block[t, :, t + 1 :].any()
        assert block[N - 1, :, 0].any()


def test_held_out_data_are_predicted_up_to_their_noise(chain: Trotters, fitted: Predictor) -> None:
    exact = chain.episode(9, 600, noise=0.0)
    _, rmse, _, _ = held_out_error(fitted, [exact])
    forgetful = np.sqrt(np.mean(exact.y**2, axis=(0, 1)))
    assert (np.array(rmse) < 0.3 * forgetful).all()


def test_forces_that_differ_at_every_sample_do_as_well() -> None:
    team = Trotters(1, ())
    predictor = fit_periodic([team.episode(3, 3000, hold=1)], meta_of(1))
    truth = true_block(team, predictor.meta, 0, 0, 5)
    found = found_block(predictor, 0, 0, 5)
    assert np.linalg.norm(found - truth) < 0.12 * np.linalg.norm(truth)
    assert predictor.meta.phases == 40


def test_strangers_are_left_out_if_only_yoked_robots_count() -> None:
    everyone = tuple((i, j) for i in range(3) for j in range(3) if i != j)
    team, meta = Trotters(3, everyone), meta_of(3, yokes="chain", neighbours="yoked")
    predictor = fit_periodic([team.episode(4, 2000)], meta)
    for i in range(3):
        for j in range(3):
            assert predictor.couples(i, j) == (abs(i - j) <= 1)
            assert predictor.block(i, j, 3).any() == (abs(i - j) <= 1)


def test_blocks_rows_and_the_whole_of_G_are_the_same(fitted: Predictor) -> None:
    G = fitted.G
    assert G.shape == (40, 3, 3, 6 * N, fitted.meta.width)
    z = np.random.default_rng(0).normal(size=(3, fitted.meta.width))
    for phase in (0, 21):
        expected = np.einsum("ijab,jb->ia", G[phase], z)
        np.testing.assert_allclose(fitted.predict(z, phase), expected, rtol=1e-9)
        np.testing.assert_array_equal(
            fitted.future_block(2, 1, phase), G[phase, 2, 1][:, fitted.meta.past :]
        )
    # A few megabytes of factors stand for what would be many times as large.
    assert fitted.nbytes < 0.2 * G.nbytes
    table = coupling_table(fitted)
    assert table.shape == (3, 3)
    assert not table[[0, 2], [2, 0]].any()


def test_a_fit_is_repeated_to_the_last_bit(chain: Trotters) -> None:
    data = [chain.episode(6, 600)]
    first, second = (fit(data, meta_of(3)) for _ in range(2))
    assert predictor_sha256(first) == predictor_sha256(second)


def test_what_is_saved_is_read(tmp_path: Path, fitted: Predictor, provenance: Provenance) -> None:
    digest = save(tmp_path / "periodic.npz", fitted, provenance)
    again, _ = read(tmp_path / "periodic.npz")
    assert isinstance(again.parts, PeriodicFactors)
    assert predictor_sha256(again) == digest
    np.testing.assert_array_equal(again.block(1, 2, 17), fitted.block(1, 2, 17))


def test_another_process_gets_the_same(fitted: Predictor) -> None:
    again = pickle.loads(pickle.dumps(fitted))
    assert predictor_sha256(again) == predictor_sha256(fitted)
    assert again.condition == fitted.condition


def test_factors_of_another_team_are_refused(fitted: Predictor) -> None:
    with pytest.raises(PredictorError, match=r"predictor\.response: got shape"):
        Predictor(meta_of(2), fitted.parts)


def test_data_too_few_to_be_divided_are_refused() -> None:
    build: Callable[..., Any] = fit_periodic
    with pytest.raises(PredictorError, match="periodic predictor"):
        build([Trotters(1, ()).episode(1, 16)], meta_of(1))
