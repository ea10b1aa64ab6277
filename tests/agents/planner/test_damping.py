"""The share of its last plan that an agent keeps if the size of the team chooses it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.planner.damping import kept_by_agent, kept_share
from quadriga.shared.config.load import load
from quadriga.shared.errors import ConfigError


def share(robots: int, **planner: object) -> float:
    return kept_share(
        load(overrides={"team.robots": robots, **{f"planner.{k}": v for k, v in planner.items()}})
    )


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


@pytest.mark.parametrize(
    ("robots", "preset", "kept"),
    [(1, "usual", 0.0), (3, "usual", 0.0), (4, "usual", 1 / 3), (2, "fast", 0.0), (3, "fast", 0.2)],
)
def test_few_robots_are_not_damped(robots: int, preset: str, kept: float) -> None:
    assert share(robots, preset=preset) == pytest.approx(kept)


def test_a_share_that_is_given_is_kept() -> None:
    assert share(10, damping=0.0) == 0.0
    assert share(2, damping=0.3) == 0.3
    assert share(10, preset="paper") == 0.0


def test_who_answers_nobody_is_damped_only_if_it_is_asked_to() -> None:
    kinds = ("distributed", "decentralised")
    teams = [load(overrides={"team.robots": 5, "planner.kind": kind}) for kind in kinds]
    assert [kept_by_agent(team) for team in teams] == [pytest.approx(3 / 7), 0.0]
    asked = load(overrides={"planner.kind": "decentralised", "planner.damping": 0.4})
    assert kept_by_agent(asked) == 0.4


def test_a_share_between_none_and_by_size_is_a_mistake() -> None:
    with pytest.raises(ConfigError, match=r"planner.damping: got -0.5, expected -1, or 0 … 0.95"):
        share(5, damping=-0.5)
