"""From configuration to an accepted predictor, on a tiny team; and every reason to refuse one."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from quadriga.agents.predictor.episode import SIGNALS
from quadriga.agents.predictor.gates import load_checked, read
from quadriga.agents.predictor.hankel import required_samples
from quadriga.identification import predictors
from quadriga.identification.cache import data_path, predictor_path
from quadriga.identification.dataset import Dataset, read_data, write_data
from quadriga.identification.predictors import ensure_data, ensure_predictor, fit
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from tests.agents.conftest import SMALL, LinearTeam
from tests.quadriga.own_cache import use_own_cache

# One robot with a short horizon: 13 · (10 + 4 + 12) − 1 = 337 samples are enough for a ridge fit.
TINY = load(
    None,
    {
        "identification.predictor": "ridge",
        "team.robots": 1,
        "planner.N": 10,
        "planner.T_ini": 4,
        "identification.seconds": 6.0,
        "identification.episode": 3.0,
        "identification.held_out": 2.0,
    },
)


def silent() -> Console:
    return Console(file=io.StringIO())


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache folder of this module's own, in which the tiny team has its predictor."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        use_own_cache(folder, patch)
        # An edit of the code in the middle of the tests must not change the keys.
        ensure_predictor(TINY, silent())
        yield folder


@pytest.fixture
def no_collection(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail if anything is collected."""

    def refuse(*_: Any) -> None:
        raise AssertionError("collected although the data were there")

    monkeypatch.setattr(predictors, "collect", refuse)


def limited(**changes: Any) -> Config:
    return replace(TINY, identification=replace(TINY.identification, **changes))


# ---- the real chain


def test_a_predictor_is_collected_fitted_accepted_and_kept(cache: Path) -> None:
    path = predictor_path(TINY)
    assert path.is_relative_to(cache)
    predictor = load_checked(path, TINY)[0]
    assert predictor.G.shape == (1, 1, 1, 60, 18 * 4 + 12 * 10)
    _, provenance = read(path)
    dataset = read_data(data_path(TINY))
    assert provenance.samples == tuple(e.samples for e in dataset.training) == (300, 300)
    assert provenance.held_out == (200,)
    assert provenance.seeds == (1000, 1001)
    assert provenance.gates.error < 1.0
    assert not list(cache.rglob("*.partial"))


@pytest.mark.usefixtures("cache", "no_collection")
def test_the_second_time_it_is_there() -> None:
    before = predictor_path(TINY).stat().st_mtime_ns
    assert ensure_predictor(TINY, silent()) == predictor_path(TINY)
    assert predictor_path(TINY).stat().st_mtime_ns == before


@pytest.mark.usefixtures("cache", "no_collection")
def test_another_fit_takes_the_same_data() -> None:
    config = limited(ridge=2e-3)
    path = ensure_predictor(config, silent())
    assert path != predictor_path(TINY)
    first, second = (read(p)[0] for p in (predictor_path(TINY), path))
    assert second.meta.ridge == 2e-3
    assert not np.allclose(first.G, second.G, rtol=1e-6)


@pytest.mark.usefixtures("cache", "no_collection")
def test_a_wrong_height_gain_is_refused_with_figure_and_limit() -> None:
    config = limited(gain_range=(5.0, 6.0))
    with pytest.raises(PredictorError) as caught:
        ensure_predictor(config, silent())
    gains = read(predictor_path(TINY))[1].gates.gains[0]
    assert "height gain of r1 at 0.1 s" in caught.value.name
    assert caught.value.got == f"{gains[0]:.2f}"
    assert "5 … 6" in caught.value.expected
    assert not predictor_path(config).exists()


@pytest.mark.usefixtures("cache", "no_collection")
@pytest.mark.parametrize("damage", ["garbage", "empty", "cut", "flipped", "missing"])
def test_damaged_data_are_one_clear_error(damage: str) -> None:
    path = data_path(TINY)
    whole = path.read_bytes()
    try:
        path.write_bytes(damaged(whole, damage))
        if damage == "missing":
            path.unlink()
        with pytest.raises(PredictorError) as caught:
            read_data(path)
    finally:
        path.write_bytes(whole)
    assert str(path) in caught.value.name
    assert "delete" in caught.value.cause


def damaged(whole: bytes, how: str) -> bytes:
    middle = len(whole) // 2
    return {
        "garbage": b"not an archive" * 100,
        "empty": b"",
        "cut": whole[:middle],
        "flipped": whole[:middle] + bytes([whole[middle] ^ 0xFF]) + whole[middle + 1 :],
    }.get(how, whole)


# ---- the gates and the rule, on a team whose response is known


@pytest.fixture(scope="module")
def team() -> Dataset:
    """Two coupled robots, enough and exciting."""
    known = LinearTeam(2)
    return Dataset((known.episode(500, 1), known.episode(500, 2)), (known.episode(200, 3),), (1, 2))


def permissive(**changes: Any) -> Config:
    """The linear team's low level has no height integrator; its order is 9 per robot."""
    wide: dict[str, Any] = {
        "predictor": "ridge",
        "gain_range": (0.1, 3.0),
        "ridge": 1e-8,
        "block_weight": 1.0,
        "order_per_robot": 9,
    }
    return replace(
        SMALL,
        identification=replace(SMALL.identification, **wide | {"max_radius": 10.0} | changes),
        controller=replace(SMALL.controller, ki_z=0.0),
    )


def test_an_accepted_fit_says_what_it_was_accepted_with(team: Dataset, tmp_path: Path) -> None:
    report = fit(permissive(), team, tmp_path / "p.npz")[1].gates
    assert report.error < 0.01
    np.testing.assert_allclose(report.gains, 1.0, atol=0.05)
    assert 0.0 < report.radius < 10.0
    _, provenance = read(tmp_path / "p.npz")
    assert provenance.gates == report


def refused(config: Config, dataset: Dataset, path: Path) -> PredictorError:
    with pytest.raises(PredictorError) as caught:
        fit(config, dataset, path)[1].gates.check(config)
    assert not path.exists()
    return caught.value


def test_too_few_samples_are_refused_by_the_rule(team: Dataset, tmp_path: Path) -> None:
    rule = required_samples(24, 4, 8, 18)
    assert rule == 749
    short = replace(team, training=(LinearTeam(2).episode(rule - 1, 1),))
    error = refused(permissive(), short, tmp_path / "p.npz")
    assert f"{rule - 1} samples" in error.got
    assert f"at least {rule}" in error.expected


def test_inputs_that_leave_a_direction_out_are_refused(team: Dataset, tmp_path: Path) -> None:
    """One force of one robot never varies."""
    poor = []
    for episode in team.training:
        u = episode.u.copy()
        u[:, 1, 5] = episode.u_nominal[:, 1, 5]
        poor.append(replace(episode, u=u))
    error = refused(permissive(), replace(team, training=tuple(poor)), tmp_path / "p.npz")
    order = 4 + 8 + 18
    assert f"rank {24 * order}: persistently exciting of order {order}" in error.expected
    assert "noise" in error.cause


# ---- files


def test_data_come_back_from_their_file_as_they_were(tmp_path: Path, team: Dataset) -> None:
    path = tmp_path / "deep" / "data.npz"
    write_data(path, team)
    back = read_data(path)
    for part in ("training", "held_out"):
        for ours, theirs in zip(getattr(team, part), getattr(back, part), strict=True):
            for name in SIGNALS:
                np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))
            assert ours.first_tick == theirs.first_tick == 410
    assert back.seeds == (1, 2)
    assert [item.name for item in path.parent.iterdir()] == ["data.npz"]


def test_more_than_ten_episodes_keep_their_order(tmp_path: Path) -> None:
    known = LinearTeam(1)
    many = tuple(known.episode(20 + k, k) for k in range(12))
    write_data(tmp_path / "data.npz", Dataset(many, many[:1], tuple(range(12))))
    back = read_data(tmp_path / "data.npz")
    assert [episode.samples for episode in back.training] == list(range(20, 32))


def test_collected_data_are_kept_even_if_the_fit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What took minutes to collect is there for the next attempt."""
    use_own_cache(tmp_path, monkeypatch)
    known = LinearTeam(1)

    def collected(config: Config, jobs: int, progress: Callable[[int, int], None]) -> Dataset:
        progress(1, 1)
        return Dataset((known.episode(100, 1),), (known.episode(60, 2),), (1,))

    monkeypatch.setattr(predictors, "collect", collected)
    with pytest.raises(PredictorError, match="at least 337"):
        ensure_predictor(TINY, silent())
    assert data_path(TINY).is_file()
    assert ensure_data(TINY, silent()).training[0].samples == 100
