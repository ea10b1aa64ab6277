"""A team whose true response is known: linear trunks driven by foot forces, coupled by springs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

from quadriga.agents.gait import scheduled_stance
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.gates import Provenance, run_gates
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta, fit
from quadriga.agents.predictor.store import save, versions
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from tests.a1 import TOTAL_MASS, nominal_forces

FEET = np.array([[0.18, 0.13], [0.18, -0.13], [-0.18, 0.13], [-0.18, -0.13]])
# Peers' windows and plans are those of the step before, as eq. 11 has them.
SMALL = Config()
SMALL = replace(
    SMALL,
    team=replace(SMALL.team, robots=2),
    planner=replace(SMALL.planner, N=8, T_ini=4, applied=4, compensation=False),
)


@dataclass(frozen=True)
class LinearTeam:
    """x⁺ = A x + B u, y_k = C x_{k+1}; u and y of all robots stacked; order 9 per robot."""

    robots: int
    coupling: float = 1.0
    A: Array = field(init=False)
    B: Array = field(init=False)
    C: Array = field(init=False)

    def __post_init__(self) -> None:
        # One robot: z, vz, vx, vy, roll, roll rate, pitch, pitch rate, wz.
        a = np.zeros((9, 9))
        for position, kp, kd in ((0, 400.0, 40.0), (4, 400.0, 40.0), (6, 400.0, 40.0)):
            a[position, position + 1] = 1.0
            a[position + 1, position : position + 2] = -kp, -kd
        a[2, 2] = a[3, 3] = a[8, 8] = -20.0
        b = np.zeros((9, 12))
        for leg, (x, y) in enumerate(FEET):
            force = np.eye(3)
            b[1, 3 * leg : 3 * leg + 3] = force[2] / TOTAL_MASS
            b[2:4, 3 * leg : 3 * leg + 3] = force[:2] / TOTAL_MASS
            b[5, 3 * leg : 3 * leg + 3] = np.array([0.0, 0.26, y]) / 0.1
            b[7, 3 * leg : 3 * leg + 3] = np.array([-0.26, 0.0, -x]) / 0.2
            b[8, 3 * leg : 3 * leg + 3] = np.array([-y, x, 0.0]) / 0.25
        n = self.robots
        laplacian = n * np.eye(n) - np.ones((n, n))
        spring = np.zeros((9, 9))
        spring[[2, 3, 5], [2, 3, 4]] = 5.0, 5.0, 30.0
        continuous = np.kron(np.eye(n), a) - self.coupling * np.kron(laplacian, spring)
        both = np.zeros((21 * n, 21 * n))
        both[: 9 * n, : 9 * n] = continuous
        both[: 9 * n, 9 * n :] = np.kron(np.eye(n), b)
        discrete = linalg.expm(0.01 * both)
        select = np.zeros((6, 9))
        select[range(6), [0, 2, 3, 4, 6, 8]] = 1.0
        object.__setattr__(self, "A", discrete[: 9 * n, : 9 * n])
        object.__setattr__(self, "B", discrete[: 9 * n, 9 * n :])
        object.__setattr__(self, "C", np.kron(np.eye(n), select))

    def respond(self, du: Array, x: Array | None = None) -> Array:
        """Output deviations (T, n, 6) to force deviations (T, n, 12) from state x (zero)."""
        x = np.zeros(len(self.A)) if x is None else x
        y = np.empty((len(du), self.robots, 6))
        for k, u in enumerate(du.reshape(len(du), -1)):
            x = self.A @ x + self.B @ u
            y[k] = (self.C @ x).reshape(self.robots, 6)
        return y

    def episode(
        self, samples: int, seed: int, *, trot: bool = False, noise: float = 0.0
    ) -> Episode:
        """A walk under random force deviations; with `trot` only stance feet carry any."""
        rng = np.random.default_rng(seed)
        du = rng.normal(size=(samples, self.robots, 12)) * np.tile([15.0, 15.0, 35.0], 4)
        ticks = 400 + 10 * np.arange(samples)
        stance = np.stack([scheduled_stance(SMALL, i, ticks) for i in range(self.robots)], axis=1)
        nominal = nominal_forces(stance)
        if trot:
            du *= np.repeat(stance, 3, axis=2)
        base = np.broadcast_to([0.26, 0.4, 0.0, 0.0, 0.0, 0.1], (samples, self.robots, 6)).copy()
        y = base + self.respond(du)
        y += noise * rng.normal(size=y.shape) * [0.005, 0.1, 0.1, 0.02, 0.02, 0.2]
        return Episode(u=nominal + du, u_nominal=nominal, y=y, y_base=base, first_tick=410)


def fit_ridge(episodes: Sequence[Episode], meta: PredictorMeta) -> Predictor:
    """The ridge fit, whatever kind the meta names."""
    return fit(episodes, replace(meta, kind="ridge"))


@pytest.fixture(scope="session")
def linear_team() -> Callable[..., LinearTeam]:
    return LinearTeam


@pytest.fixture(scope="session")
def small() -> Config:
    """Two robots with short horizons, so that reference solutions stay cheap."""
    return SMALL


@pytest.fixture(scope="module")
def predictor(small: Config) -> Predictor:
    """Of a team of two, as good as exact."""
    meta = replace(PredictorMeta.of(small), ridge=1e-10, block_weight=1.0)
    return fit_ridge([LinearTeam(2).episode(1500, 1)], meta)


@pytest.fixture(scope="module")
def plant(small: Config) -> Config:
    return replace(small, controller=replace(small.controller, ki_z=0.0))


@pytest.fixture(scope="module")
def fitted(plant: Config) -> tuple[Predictor, Provenance]:
    """A predictor that passes its gates, and what is known about it."""
    team = LinearTeam(2)
    predictor = fit_ridge([team.episode(900, 1)], PredictorMeta.of(plant))
    report = run_gates(plant, predictor, [team.episode(100, 2)])
    return predictor, Provenance("abc", (1,), (900,), (100,), versions(), report)


@pytest.fixture
def stored(tmp_path: Path, fitted: tuple[Predictor, Provenance]) -> Path:
    path = tmp_path / "cache" / "predictor.npz"
    save(path, fitted[0], asdict(fitted[1]))
    return path
