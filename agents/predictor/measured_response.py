"""The team's true response to wrenches, as a probe has measured it, in the terms of a periodic G.

With it a planner knows the coupling as well as anybody can: what a simulator alone can give.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.episode import Layout
from quadriga.agents.predictor.periodic import DEGREE, Period, polynomials, spread_over_samples
from quadriga.shared.errors import PredictorFileError
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, as_counts, as_measured, open_npz

_KEY: Final = "identification.response"
_RANK: Final = 1e-6  # two stance feet have no moment about their own line: no response to that


@dataclass(frozen=True, slots=True)
class PulseResponses:
    """Responses to pulses, means over worlds.

    Attributes:
        ticks: at which the pulses begin, one for each of P phases of the gait, shape (P,), ms.
        u: force deviation that the pulse is, by phase, pulsed robot, direction and sample of the
            horizon, shape (P, n, D, N, 12), N, yaw frame.
        y: what the pulse changes, by phase, pulsed robot, direction, sample and responding robot,
            shape (P, n, D, N, n, 6), m, m/s, m/s, rad, rad, rad/s.
        team: that was measured, see `quadriga.identification.predictors.measured_team`.
    """

    ticks: NDArray[np.int64]
    u: Array
    y: Array
    team: dict[str, Any]


def write_pulse_responses(path: Path, responses: PulseResponses) -> None:
    """Keep responses; a file half written never has the name `path`."""
    arrays = {name: getattr(responses, name) for name in ("ticks", "u", "y")}
    with atomic_write(path) as partial, partial.open("wb") as file:
        np.savez_compressed(file, team=json.dumps(responses.team), **arrays)


def read_pulse_responses(path: Path) -> PulseResponses:
    """Responses from a file.

    Raises:
        PredictorFileError: no such file, or not one of responses.
    """
    try:
        with open_npz(path) as archive:
            team = json.loads(str(archive["team"]))
            if not isinstance(team, dict):
                raise ValueError("no team")
            ticks = as_counts("ticks", archive["ticks"], 1)
            u, y = as_measured("u", archive["u"], 5), as_measured("y", archive["y"], 6)
            return PulseResponses(ticks, u, y, team)
    except UNREADABLE as error:
        raise PredictorFileError(
            f"{_KEY} {path}",
            "no such file" if isinstance(error, FileNotFoundError) else type(error).__name__,
            "responses that `quadriga probe --out DIR` wrote",
            "measure them with the same team",
        ) from None


def fit_measured_response(
    responses: PulseResponses, layout: Layout, period: Period, wrench: Array
) -> Array:
    """Coefficients of the response to a sample's wrench, scaled; see `PeriodicFactors.response`.

    The response to a pulse of S samples is a polynomial of the phase in each half of the gait's
    period, by least squares over phases and directions; then that to a single sample follows, see
    `spread_over_samples`.

    Args:
        responses: of the team.
        layout: of the predictor.
        period: of the gait.
        wrench: from the forces of a robot to their net wrench, (w, 12).

    Returns:
        Shape (2 DEGREE + 2, N, n pushing, w, n responding, 6).

    Raises:
        PredictorFileError: the responses are those of another number of robots or horizon.
    """
    n, N, p, phases = layout.agents, layout.N, layout.outputs, len(responses.ticks)
    expected = (phases, n, responses.y.shape[2], N, n, p)
    if responses.y.shape != expected or responses.u.shape != (*expected[:4], layout.inputs):
        got = f"responses of shape {responses.y.shape}"
        raise PredictorFileError(_KEY, got, f"{expected}", "another team or horizon?")
    angles = 2.0 * np.pi * ((responses.ticks - period.begin) % period.ticks) / period.ticks
    values = polynomials(angles, DEGREE)
    wrenches = responses.u @ wrench.T  # (P, n, D, N, w)
    if not wrenches.any():
        raise PredictorFileError(_KEY, "pulses of nothing", "forces")
    hold = int(np.flatnonzero(np.abs(wrenches).max(axis=(0, 1, 2, 4)))[-1]) + 1
    g = np.empty((values.shape[1], N, n, len(wrench), n, p))
    for j in range(n):
        rows = np.einsum("pk,pdw->pdkw", values, wrenches[:, j, :, 0])
        answers = responses.y[:, j] / np.array(layout.y_scale)  # (P, D, N, n, 6)
        count = rows.shape[0] * rows.shape[1]
        found = np.linalg.lstsq(rows.reshape(count, -1), answers.reshape(count, -1), rcond=_RANK)[0]
        g[:, :, j] = found.reshape(values.shape[1], -1, N, n, p).swapaxes(1, 2)
    return spread_over_samples(g, hold, period.angle_step)
