"""The team's true response to wrenches, as a probe has measured it, in the terms of a periodic G.

With it a planner knows the coupling as well as anybody can: what a simulator alone can give.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import numpy as np

from quadriga.agents.predictor.episode import Y_SCALE, wrench_map
from quadriga.agents.predictor.periodic import DEGREE, polynomials, spread_over_samples
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.experiments.probe.responses import Responses
from quadriga.identification.predictors import measured_team
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.atomic import atomic_write

_RANK: Final = 1e-6  # two stance feet have no moment about their own line: no response to that


def write_measured_response(path: Path, responses: Responses, config: Config) -> None:
    """Keep the response for `identification.response`, with what it depends on."""
    response, team = fit_measured_response(responses, config), json.dumps(measured_team(config))
    with atomic_write(path) as partial, partial.open("wb") as file:
        np.savez_compressed(file, response=response, team=team)


def fit_measured_response(responses: Responses, config: Config) -> Array:
    """Coefficients of the response to a sample's wrench, scaled; see `PeriodicFactors.response`.

    The response to a pulse of S samples is a polynomial of the phase in each half of the gait's
    period, by least squares over phases and directions; then that to a single sample follows, see
    `spread_over_samples`.

    Args:
        responses: of the team.
        config: of the team.

    Returns:
        Shape (2 DEGREE + 2, N, n pushing, w, n responding, 6).
    """
    meta = PredictorMeta.of(config)
    period, (_, n, _, N, _, p) = meta.period, responses.y.shape
    angles = 2.0 * np.pi * ((responses.ticks - period.begin) % period.ticks) / period.ticks
    values = polynomials(angles, DEGREE)
    wrenches = responses.u @ wrench_map(meta.robot).T  # (P, n, D, N, w)
    hold = int(np.flatnonzero(np.abs(wrenches).max(axis=(0, 1, 2, 4)))[-1]) + 1
    g = np.empty((2 * DEGREE + 2, N, n, wrenches.shape[-1], n, p))
    for j in range(n):
        rows = np.einsum("pk,pdw->pdkw", values, wrenches[:, j, :, 0])
        answers = responses.y[:, j] / Y_SCALE  # (P, D, N, n, 6)
        count = rows.shape[0] * rows.shape[1]
        found = np.linalg.lstsq(rows.reshape(count, -1), answers.reshape(count, -1), rcond=_RANK)[0]
        g[:, :, j] = found.reshape(len(g), -1, N, n, p).swapaxes(1, 2)
    return spread_over_samples(g, hold, period.angle_step)
