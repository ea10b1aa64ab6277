"""The team's true response to wrenches, as a probe has measured it, in the terms of a periodic G.

With it a planner knows the coupling as well as anybody can: what a simulator alone can give.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.predictor.episode import N_WRENCH, Y_SCALE, wrench_map
from quadriga.agents.predictor.periodic import DEGREE, polynomials, spread_over_samples
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorFileError
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.atomic import atomic_write
from quadriga.shared.runtime.npz import UNREADABLE, as_counts, as_measured, open_npz

# What a true response depends on beside the controller: of a predictor's meta, and sections.
_TEAM: Final = (
    "robots", "robot", "yokes", "alternate_phase", "stance_ms", "stand_ms", "interface",
)  # fmt: skip
_PLANT: Final = ("motors", "sensors", "estimator")
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
        team: that was measured, see `measured_team`.
    """

    ticks: NDArray[np.int64]
    u: Array
    y: Array
    team: dict[str, Any]


def measured_team(config: Config) -> dict[str, Any]:
    """What a team's true response depends on, by key, as JSON has it."""
    meta = PredictorMeta.of(config)
    known = {name: getattr(meta, name) for name in _TEAM}
    known |= {f"controller.{key}": value for key, value in meta.controller}
    for section in _PLANT:
        known |= {f"{section}.{k}": v for k, v in asdict(getattr(config, section)).items()}
    team: dict[str, Any] = json.loads(json.dumps(known))
    return team


def check_measured_team(config: Config) -> None:
    """Refuse configured responses of another team.

    Raises:
        PredictorFileError: no such file, not one of responses, or of another team.
    """
    if not config.response_file:
        return
    measured = read_pulse_responses(Path(config.response_file)).team
    for key, expected in measured_team(config).items():
        if measured.get(key) != expected:
            got = f"responses of a team with {key} = {measured.get(key)!r}"
            raise PredictorFileError(_KEY, got, f"{expected!r}", "measure it: `quadriga probe`")


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


def fit_measured_response(responses: PulseResponses, meta: PredictorMeta) -> Array:
    """Coefficients of the response to a sample's wrench, scaled; see `PeriodicFactors.response`.

    The response to a pulse of S samples is a polynomial of the phase in each half of the gait's
    period, by least squares over phases and directions; then that to a single sample follows, see
    `spread_over_samples`.

    Returns:
        Shape (2 DEGREE + 2, N, n pushing, 6, n responding, 6).

    Raises:
        PredictorFileError: the responses are those of another number of robots or horizon.
    """
    n, N, phases, period = meta.robots, meta.N, len(responses.ticks), meta.period
    expected = (phases, n, responses.y.shape[2], N, n, N_OUTPUTS)
    if responses.y.shape != expected or responses.u.shape != (*expected[:4], N_FORCES):
        got = f"responses of shape {responses.y.shape}"
        raise PredictorFileError(_KEY, got, f"{expected}", "another team or horizon?")
    angles = 2.0 * np.pi * ((responses.ticks - period.begin) % period.ticks) / period.ticks
    values = polynomials(angles, DEGREE)
    wrenches = responses.u @ wrench_map(meta.robot).T  # (P, n, D, N, 6)
    if not wrenches.any():
        raise PredictorFileError(_KEY, "pulses of nothing", "forces")
    hold = int(np.flatnonzero(np.abs(wrenches).max(axis=(0, 1, 2, 4)))[-1]) + 1
    g = np.empty((values.shape[1], N, n, N_WRENCH, n, N_OUTPUTS))
    for j in range(n):
        rows = np.einsum("pk,pdw->pdkw", values, wrenches[:, j, :, 0])
        answers = responses.y[:, j] / Y_SCALE  # (P, D, N, n, 6)
        count = rows.shape[0] * rows.shape[1]
        found = np.linalg.lstsq(rows.reshape(count, -1), answers.reshape(count, -1), rcond=_RANK)[0]
        by_lag = found.reshape(values.shape[1], N_WRENCH, N, n, N_OUTPUTS)
        g[:, :, j] = by_lag.swapaxes(1, 2)
    return spread_over_samples(g, hold, period.angle_step)
