"""The whole team in one process: it walks, is seen right by its estimators, and repeats itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.rollout import Rollout, build_agents
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.messages import Message, Reference
from quadriga.shared.robots.conventions import Array
from tests.a1 import STAND_HEIGHT
from tests.agents.duet import simple_predictor
from tests.sim_server.standing import SILENT

SPEED = 0.5


def reference(tick: int) -> Reference | None:
    """Half a second from standing to full speed."""
    share = min(1.0, max(0.0, (tick - 300) / 500))
    return None if tick % 100 else Reference(tick, tick * 1_000_000, share * SPEED, 0.0, 0.0, 0.26)


@dataclass(frozen=True)
class Walk:
    """Truth and estimate of every robot at every tick: (ticks, n, ·), world frame."""

    fallen: tuple[str, ...]
    position: Array
    velocity: Array
    estimated: Array

    def last_second(self) -> Array:
        """Mean velocity of every robot over the last second."""
        mean: Array = (self.position[-1] - self.position[-1001]) / 1.0
        return mean


def walk(config: Config, ticks: int, predictor: Predictor | None = None) -> Walk:
    rollout = Rollout(config, predictor, reference)
    position, velocity, estimated = [], [], []
    for _ in range(ticks):
        truth = rollout.world.truth()
        rollout.step()
        states = [rollout.states[name].controller_state for name in rollout.world.names]
        position.append(truth.base_pos)
        velocity.append(truth.base_vel)
        estimated.append([state.velocity for state in states if state is not None])
    return Walk(rollout.world.fallen(), *map(np.array, (position, velocity, estimated)))


def test_one_robot_walks_as_fast_as_it_is_asked_to() -> None:
    found = walk(load(None, {"team.robots": 1}), 2500)
    assert not found.fallen
    assert found.last_second()[0, 0] == pytest.approx(SPEED, abs=0.05)
    assert abs(found.last_second()[0, 1]) < 0.1
    np.testing.assert_allclose(found.position[800:, 0, 2], STAND_HEIGHT, atol=0.02)


def test_without_noise_the_estimated_velocity_is_the_true_one() -> None:
    config = replace(load(None, {"team.robots": 1}), sensors=SILENT)
    found = walk(config, 1500)
    error = found.estimated - found.velocity
    assert np.sqrt((error[300:, 0] ** 2).mean(axis=0)).max() < 0.02
    np.testing.assert_allclose(error[300:, 0].mean(axis=0), 0.0, atol=0.01)


@pytest.mark.parametrize("preset", ["plain", "soft"])
def test_the_other_settings_walk_on_flat_ground_too(preset: str) -> None:
    config = load(None, {"team.robots": 1, "controller.preset": preset})
    found = walk(config, 2000)
    assert not found.fallen
    assert found.last_second()[0, 0] == pytest.approx(SPEED, abs=0.15)


def test_two_yoked_robots_walk_together_without_a_planner() -> None:
    found = walk(load(None, {"team.robots": 2}), 2000)
    assert not found.fallen
    np.testing.assert_allclose(found.last_second()[:, 0], SPEED, atol=0.1)
    distance = np.linalg.norm(found.position[:, 0, :2] - found.position[:, 1, :2], axis=1)
    np.testing.assert_allclose(distance, 0.9, atol=0.05)


def traffic(seed: int, ticks: int = 420) -> list[bytes]:
    """All that two planning agents send, in order."""
    config = load(None, {"team.robots": 2, "world.seed": seed})
    rollout = Rollout(config, simple_predictor(config), reference)
    sent: list[bytes] = []
    for tick in rollout.ticks(ticks):
        for out in tick.outputs.values():
            messages: tuple[Message | None, ...] = (out.command, out.measurement, out.plan)
            sent += [encode(message) for message in messages if message is not None]
    return sent


def test_a_seed_repeats_a_walk_to_the_byte_and_another_does_not() -> None:
    first = traffic(1)
    assert len(first) == 2 * (420 + 41 + 3)
    assert traffic(1) == first
    other = traffic(2)
    assert len(other) == len(first)
    assert sum(a != b for a, b in zip(first, other, strict=True)) > 0.9 * len(first)


def test_a_rollout_ends_with_the_first_fall() -> None:
    config = load(None, {"team.robots": 1, "world.push": "r1:2000:90:0.4:0.2"})
    rollout = Rollout(config, None, reference)
    ticks = list(rollout.ticks(2000))
    assert 400 < len(ticks) < 1500
    assert [event.kind for event in ticks[-1].events] == ["fall"]
    assert rollout.world.fallen() == ("r1",)
    assert [tick.tick for tick in ticks] == list(range(len(ticks)))


def test_excitation_reaches_the_robot_it_is_meant_for() -> None:
    config = load(None, {"team.robots": 2})
    push = np.tile([0.0, 0.0, 20.0], 4)
    rollout = Rollout(config, None, reference, lambda name, _: push * (name == "r2"))
    *_, last = rollout.ticks(341)
    first, second = (last.outputs[name].measurement for name in ("r1", "r2"))
    assert first is not None
    assert second is not None
    assert first.u.sum() == pytest.approx(second.u.sum() - 40.0)  # two of four legs stand


def test_a_controller_of_ones_own_does_not_walk_in_this_process() -> None:
    config = load(None, {"team.robots": 1, "team.agent_command": "walk"})
    with pytest.raises(ConfigError, match=r"team\.agent_command: got 'walk', expected '': agents"):
        build_agents(config, None)
