"""What the data say before any weight is chosen: ranks, and data that do not do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from quadriga.agents.predictor.deepc import reduce
from quadriga.shared.errors import PredictorError

Team = Callable[..., Any]
T_INI, N = 2, 3


def test_data_without_noise_have_the_rank_of_the_plant(linear_team: Team) -> None:
    """Fundamental lemma: forces fill all their directions, outputs add one per state."""
    for n in (1, 2):
        plant = linear_team(n)
        clean, noisy = (
            reduce(
                [plant.episode(samples * n, samples, noise=noise) for samples in (70, 55)], T_INI, N
            )
            for noise in (0.0, 0.3)
        )
        assert clean.spread.shape == (6 * n * (T_INI + N), 9 * n)
        assert noisy.spread.shape == (6 * n * (T_INI + N), 6 * n * (T_INI + N))


def test_short_or_dull_data_are_refused(linear_team: Team) -> None:
    episode = linear_team(1).episode(40, 0)
    with pytest.raises(PredictorError, match="persistently exciting of order 5"):
        reduce([episode], T_INI, N)
    still = linear_team(1).episode(200, 0)
    u = still.u.copy()
    u[:, :, 3] = still.u_nominal[:, :, 3]
    with pytest.raises(PredictorError, match="persistently exciting"):
        reduce([replace(still, u=u)], T_INI, N)
    with pytest.raises(PredictorError, match="data of one team"):
        reduce([], T_INI, N)
    with pytest.raises(PredictorError, match="data of one team"):
        reduce([still, linear_team(2).episode(200, 0)], T_INI, N)
