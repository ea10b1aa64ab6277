"""Short walks of data collection: what cached data depend on besides their configuration."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from quadriga.agents.predictor.episode import SIGNALS
from quadriga.identification.collect import PlannedEpisode, collect_episode
from quadriga.shared.config.load import load
from quadriga.shared.robots.conventions import Array

_SECONDS: Final = 1.0
_WALK: Final = {"gait.stand_ms": 100, "identification.hold": 0.2}
_WALKS: Final[tuple[dict[str, Any], ...]] = (
    {"team.robots": 2, "team.alternate_phase": False},
    {"team.robots": 1, "estimator.kind": "truth", "controller.preset": "soft"},
    {"team.robots": 1, "controller.preset": "plain", "planner.interface": "force"},
)


def samples() -> Iterator[Array]:
    """The episodes of a second's walks, each with another low level."""
    for keys in _WALKS:
        episode = collect_episode(load(None, _WALK | keys), PlannedEpisode(0, _SECONDS))
        yield np.array(episode is not None)
        if episode is not None:
            yield from (getattr(episode, name) for name in SIGNALS)
