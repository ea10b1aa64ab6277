"""Data collection: what an episode holds, that a seed repeats it, what becomes of falls."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.hankel import required_samples
from quadriga.identification import collect as module
from quadriga.identification.collect import (
    PlannedEpisode,
    build_dataset,
    collect,
    collect_episode,
    collection_config,
    collection_seconds,
    plan_episodes,
    spread,
    training_seconds,
)
from quadriga.identification.rollout import Rollout, Tick
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config, WorldConfig
from quadriga.shared.errors import PredictorError

NOISE = (10.0, 20.0, 30.0)
TOGETHER = (16.0, 12.0, 8.0, 14.0, 10.0)


def config_of(robots: int = 1, **keys: Any) -> Config:
    given = {
        "team.robots": robots,
        "identification.noise": NOISE,
        "identification.wrench_noise": (0.0,) * 5,
    }
    return load(None, given | {name.replace("__", "."): value for name, value in keys.items()})


@pytest.fixture(scope="module")
def episode() -> Episode:
    """One and a half seconds of two robots."""
    found = collect_episode(config_of(2), PlannedEpisode(0, 1.5))
    assert found is not None
    return found


def test_an_episode_has_a_sample_every_ten_milliseconds(episode: Episode) -> None:
    assert episode.samples == 150
    assert episode.first_tick == 310  # the first sample after the stand ends there
    assert episode.u.shape == episode.u_nominal.shape == (150, 2, 12)
    assert episode.y.shape == episode.y_base.shape == (150, 2, 6)


def test_noise_is_on_the_stance_feet_alone_and_held_for_twenty_milliseconds(
    episode: Episode,
) -> None:
    noise, _ = episode.deviations()
    stance = np.repeat(episode.u_nominal[:, :, 2::3] > 0.0, 3, axis=2)
    assert not noise[~stance].any()
    assert (noise[stance] != 0.0).all()
    # The stand ends at 300 ms, a multiple of the hold: draws begin with even samples.
    np.testing.assert_allclose(noise[0::2], noise[1::2], atol=1e-9)
    assert (noise[2::2][stance[2::2]] != noise[1:-1:2][stance[2::2]]).all()


def test_noise_has_the_spread_asked_for_and_no_outliers(episode: Episode) -> None:
    noise = episode.deviations()[0].reshape(150, 2, 4, 3)[::2]
    for axis, sigma in enumerate(NOISE):
        drawn = noise[..., axis][noise[..., axis] != 0.0]
        assert drawn.std() == pytest.approx(sigma, rel=0.15)
        assert np.abs(drawn).max() <= 2.5 * sigma + 1e-9
    within = (noise != 0.0) & (np.abs(noise) < 2.4 * np.array(NOISE))
    first, second = (noise[:, robot][within[:, robot]] for robot in range(2))
    assert not np.isin(first, second).any()  # every robot has its own


def test_a_robots_feet_push_together() -> None:
    """Draws of net forces and couples alone: each is of the size asked for, of either sign."""
    keys: dict[str, Any] = {"noise": (0.0, 0.0, 0.0), "wrench_noise": TOGETHER}
    config = config_of(2, **{f"identification__{name}": value for name, value in keys.items()})
    episode = collect_episode(config, PlannedEpisode(0, 1.0))
    assert episode is not None
    stance = episode.u_nominal[:, :, 2::3] > 0.0
    noise = episode.deviations()[0].reshape(100, 2, 4, 3)
    patterns = module.force_patterns(config.robot.feet_under_hips).reshape(5, 4, 3)
    signs = np.zeros((100, 2, 5))
    for k, robot in np.ndindex(100, 2):
        feet = stance[k, robot]
        of_feet = (patterns[:, feet] * np.array(TOGETHER)[:, None, None]).reshape(5, -1)
        signs[k, robot], rest, *_ = np.linalg.lstsq(of_feet.T, noise[k, robot, feet].ravel())
        assert rest < 1e-15
    np.testing.assert_allclose(np.abs(signs), 1.0, atol=1e-9)
    np.testing.assert_allclose(signs[0::2], signs[1::2], atol=1e-9)
    assert (np.abs(signs.mean(axis=0)) < 0.5).all()
    assert (signs[:, 0] != signs[:, 1]).any(axis=0).all()


def test_patterns_of_forces_add_up_to_net_forces_and_couples() -> None:
    feet = config_of().robot.feet_under_hips
    patterns = module.force_patterns(feet).reshape(5, 4, 3)
    np.testing.assert_array_equal(patterns[:3].sum(axis=1), 4.0 * np.eye(3))
    arms = np.column_stack([feet, np.zeros(4)])
    for pair in ([0, 3], [1, 2]):  # the feet that stand together
        couples = patterns[3:, pair]
        np.testing.assert_allclose(couples.sum(axis=1), 0.0, atol=1e-12)
        moments = np.cross(arms[pair], couples).sum(axis=1)
        assert moments[0, 2] == 0.0
        assert moments[0, 1] == pytest.approx(-2.0 * feet[0, 0])
        assert moments[1] == pytest.approx([0.0, 0.0, 2.0 * np.linalg.norm(feet[0])])


def test_outputs_are_counted_from_what_was_asked(episode: Episode) -> None:
    """From standing, ramped to the random speed after the hold; the same for all robots."""
    base = episode.y_base
    np.testing.assert_array_equal(base[:, 0], base[:, 1])
    np.testing.assert_array_equal(base[:, :, 3:5], 0.0)
    np.testing.assert_array_equal(base[:, :, 0], 0.26)
    assert np.abs(episode.deviations()[1][:, :, 0]).max() < 0.05
    before = base[: 150 - 30]  # the first speed is zero, held until 1.5 s of world time
    assert not before[:, :, [1, 2, 5]].any()
    assert base[-1, 0, [1, 2, 5]].any()


def test_with_the_interface_force_outputs_are_counted_from_standing_still() -> None:
    found = collect_episode(config_of(planner__interface="force"), PlannedEpisode(3, 1.0))
    assert found is not None
    expected = np.broadcast_to([0.26, 0.0, 0.0, 0.0, 0.0, 0.0], (100, 1, 6))
    np.testing.assert_array_equal(found.y_base, expected)


def test_an_episode_is_repeated_by_its_number_and_by_no_other() -> None:
    config = config_of()
    first, again, other = (
        collect_episode(config, PlannedEpisode(number, 0.5)) for number in (1, 1, 2)
    )
    assert first is not None
    assert again is not None
    assert other is not None
    assert first.u.tobytes() == again.u.tobytes()
    assert first.y.tobytes() == again.y.tobytes()
    assert not np.allclose(first.u, other.u)
    shifted = replace(config, identification=replace(config.identification, seed=1001))
    same = collect_episode(shifted, PlannedEpisode(0, 0.5))
    assert same is not None
    assert same.y.tobytes() == first.y.tobytes()


def test_data_are_collected_on_flat_and_empty_ground_without_a_planner() -> None:
    config = config_of(
        world__terrain="boxes",
        world__payload=5.0,
        world__push="r1:50:0:1:1",
        world__mode="realtime",
        world__friction=0.7,
    )
    found = collection_config(config, PlannedEpisode(7, 1.0))
    assert found.world == WorldConfig(seed=1007)
    assert (found.world.terrain, found.world.payload, found.world.push) == ("flat", 0.0, "")
    assert (found.world.mode, found.planner.kind) == ("lockstep", "none")
    assert found.controller == config.controller


class Tripped(Rollout):
    """A walk that somebody ends at a given tick by laying the robot on its back."""

    at = 0

    def step(self) -> Tick:
        if self.world.tick == self.at:
            self.world.physics.qpos[2] += 0.2
            self.world.physics.qpos[3:7] = 0.0, 1.0, 0.0, 0.0
        return super().step()


def test_an_episode_that_ends_in_a_fall_is_cut_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "Rollout", Tripped)
    monkeypatch.setattr(Tripped, "at", 300 + 3600)
    found = collect_episode(config_of(), PlannedEpisode(0, 4.5))
    assert found is not None
    assert 300 <= found.samples <= 400
    y = found.y[:, 0]
    assert np.abs(y[:, 3]).max() < 0.2  # it was still upright
    assert y[:, 0].min() > 0.2


def test_an_episode_that_ends_in_an_early_fall_is_of_no_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "Rollout", Tripped)
    monkeypatch.setattr(Tripped, "at", 500)
    assert collect_episode(config_of(), PlannedEpisode(0, 4.0)) is None


def test_the_seeds_are_those_of_the_episodes_that_were_kept(episode: Episode) -> None:
    """Walk 1 of three was lost, walk 3 is held out."""
    config = config_of(2, identification__seed=1000)
    short = replace(config.identification, seconds=4.5, episode=1.5)
    config = replace(config, identification=short)
    found = build_dataset(config, {0: episode, 1: None, 2: episode, 3: episode})
    assert found.seeds == (1000, 1002)
    assert found.training == (episode, episode)
    assert found.held_out == (episode,)
    with pytest.raises(PredictorError, match="150 samples, held-out episode kept"):
        build_dataset(config, {0: None, 1: None, 2: episode, 3: episode})
    with pytest.raises(PredictorError, match="300 samples, held-out episode lost"):
        build_dataset(config, {0: episode, 1: None, 2: episode, 3: None})


def test_a_share_of_the_walks_is_disturbed_instead_of_excited() -> None:
    config = config_of(1, identification__seconds=42.0, identification__disturbed=0.75)
    noisy, last, disturbed = (plan := plan_episodes(config))[:4], plan[4], plan[5:]
    assert [episode.number for episode in plan] == list(range(8))
    assert all(episode.disturbance is None for episode in (*noisy, last))
    assert {episode.seconds for episode in (*noisy, *disturbed)} == {10.5}
    assert collection_seconds(config) == 42.0 + 8.0 + 31.5
    worlds = [collection_config(config, episode).world for episode in disturbed]
    assert [(w.terrain, w.push_force > 0.0) for w in worlds] == [
        ("boxes", False), ("flat", True), ("boxes", True)
    ]  # fmt: skip
    found = collect_episode(config, replace(disturbed[0], seconds=0.5))
    assert found is not None
    np.testing.assert_allclose(found.u, found.u_nominal, atol=1e-9)


@given(noisy=st.integers(1, 60), disturbed=st.integers(0, 60))
def test_disturbed_walks_lie_evenly_between_the_others(noisy: int, disturbed: int) -> None:
    """Of the first m walks the share that is disturbed is the same as of all, but for one walk."""
    order = spread([*range(noisy), *range(noisy + 1, noisy + 1 + disturbed)], noisy)
    assert sorted(order) == [k for k in range(noisy + 1 + disturbed) if k != noisy]
    for m in range(len(order) + 1):
        so_far = sum(number > noisy for number in order[:m])
        assert abs(so_far - m * disturbed / (noisy + disturbed)) <= 1.0


def test_what_is_collected_follows_from_the_rule_unless_it_is_given() -> None:
    config = config_of(3)
    rule = required_samples(36, config.planner.T_ini, config.planner.N, 36)
    assert rule == 37 * (10 + 25 + 36) - 1
    assert training_seconds(config) == pytest.approx(0.01 * 2 * rule)
    assert training_seconds(config_of(1)) >= 20.0
    assert training_seconds(config_of(3, identification__seconds=7.0)) == 7.0
    assert training_seconds(config_of(1, identification__wrench_noise=TOGETHER)) == 200.0
    assert training_seconds(config_of(3, identification__wrench_noise=TOGETHER)) == 600.0


def test_walks_that_all_end_in_a_fall_are_reported_with_figures() -> None:
    """A robot whose feet push with more than its weight falls at once, in the real processes."""
    config = config_of(
        identification__noise=(200.0, 200.0, 200.0),
        identification__seconds=6.0,
        identification__held_out=3.0,
        identification__episode=3.0,
    )
    seen: list[tuple[int, int]] = []
    with pytest.raises(PredictorError) as caught:
        collect(config, 2, lambda done, total: seen.append((done, total)))
    assert "0 samples, held-out episode lost" in caught.value.got
    assert "half of 600 samples" in caught.value.expected
    assert "identification.noise" in caught.value.cause
    assert seen == [(done, 3) for done in range(4)]
