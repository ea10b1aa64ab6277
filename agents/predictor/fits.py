"""The fits of G by name, for a team of robots and for any other plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from quadriga.agents.predictor.episode import (
    Episode,
    Layout,
    as_signal,
    check_episodes,
    everyone,
    wrench_map,
)
from quadriga.agents.predictor.measured_response import fit_measured_response, read_pulse_responses
from quadriga.agents.predictor.periodic import fit_periodic
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.regression import (
    hankel_rank,
    normal_equations,
    solve_pinv,
    solve_ridge,
    to_physical,
)
from quadriga.shared.errors import PredictorError, did_you_mean
from quadriga.shared.robots.conventions import Array

KINDS: Final = ("pinv", "ridge", "periodic")


def fit(episodes: Sequence[Episode], meta: PredictorMeta, wrench: Array | None = None) -> Predictor:
    """The fit that `meta.kind` names.

    - pinv: G = Y_f [U_p; Y_p; U_f]† (eq. 6).
    - ridge: row i minimises ‖Y_f^i − Σ_j G_ij Z_j‖² + ridge · M · (‖G_ii‖² + w² Σ_{j≠i} ‖G_ij‖²)
      with M columns: effects that the data do not clearly show are not attributed to the peers.
      Without this weight the agents' best responses to each other's last plans diverge.
    - periodic: a function of the phase in which no input acts backwards, see `periodic`; of a team
      that of the gait, with peers by their net wrench. Measured responses stand for fitted ones if
      there is a file of them.

    Args:
        episodes: of the plant.
        meta: what is fitted.
        wrench: of `periodic`, from an agent's inputs to what they act by, (w, m); None: of the
            robot.

    Raises:
        PredictorError: no data, too little, of another plant, or a singular problem.
        PredictorFileError: the file of measured responses cannot be read, or is another team's.
    """
    layout = meta.layout
    if meta.kind == "periodic":
        check_episodes(episodes, layout)
        B = wrench_map(meta.robot) if wrench is None else wrench
        response = None
        if meta.response:
            response = fit_measured_response(read_pulse_responses(Path(meta.response)), meta)
        factors = fit_periodic(episodes, layout, meta.period, B, response)
        phases = max(1, meta.period.ticks // meta.period.sample)
        return Predictor(replace(meta, phases=phases), factors)
    regression = normal_equations(episodes, layout)
    if meta.kind == "pinv":
        meta = replace(meta, phases=1, ridge=0.0, block_weight=1.0)
        x = solve_pinv(regression, layout)
    else:
        meta = replace(meta, phases=1)
        x = solve_ridge(regression, layout, meta.ridge, meta.block_weight)
    return Predictor(meta, to_physical(x, layout)[None])


def fit_plant(
    episodes: Sequence[Episode],
    kind: str = "pinv",
    T_ini: int = 4,
    N: int = 30,
    *,
    ridge: float = 1e-6,
    block_weight: float = 1.0,
    period: int = 1,
    input_map: ArrayLike | None = None,
) -> Predictor:
    """Fit a predictor of any plant.

    Signals are scaled by their root mean square before they are fitted, so that a ridge means the
    same for every plant.

    Args:
        episodes: of the plant, see `Episode.of`.
        kind: one of `KINDS`, see `fit`.
        T_ini: samples of the past that tell the plant's state: at least its lag.
        N: samples to predict.
        ridge: penalty per window on scaled columns, of `ridge`.
        block_weight: of `ridge` and several agents: the penalty on what one does to another is this
            squared times as large.
        period: of `periodic`: samples after which the plant repeats itself.
        input_map: of `periodic`: what the inputs of an agent act by, shape (w, m), such as the net
            wrench of forces; the identity if left out.

    Raises:
        PredictorError: an unknown kind, too little data, or inputs that do not excite the plant.
    """
    if kind not in KINDS:
        raise PredictorError("kind", repr(kind), ", ".join(KINDS), did_you_mean(kind, KINDS))
    if (period > 1) != (kind == "periodic"):
        raise PredictorError("period", f"{period} of {kind!r}", "above 1 of 'periodic', else 1")
    if not (T_ini >= 1 and N >= 1 and ridge >= 0.0 and block_weight > 0.0):
        got = f"{T_ini}, {N}, {ridge:g}, {block_weight:g}"
        raise PredictorError("T_ini, N, ridge, block_weight", got, "numbers above 0")
    if not episodes:
        raise PredictorError("episodes", "none", "at least one")
    n, m, p = *episodes[0].u.shape[1:], episodes[0].y.shape[2]
    B = np.eye(m) if input_map is None else as_signal("input_map", input_map)[:, 0]
    if B.shape[1] != m:
        raise PredictorError("input_map", f"shape {B.shape}", f"(w, {m})")
    check_episodes(episodes, Layout(n, m, p, T_ini, N, (1.0,) * m, (1.0,) * p, everyone(n)))
    inputs = [episode.deviations()[0] for episode in episodes]
    scales = _sizes(inputs), _sizes([episode.deviations()[1] for episode in episodes])
    layout = Layout(n, m, p, T_ini, N, *scales, everyone(n))
    meta = PredictorMeta(n, N, T_ini, kind, period, ridge, block_weight, plant=layout)
    if kind == "pinv" or ridge == 0.0:
        scaled = [episode.scaled_deviations(layout)[0] for episode in episodes]
        rank, full = hankel_rank(scaled, T_ini + N), n * m * (T_ini + N)
        if rank < full:
            raise PredictorError(
                "inputs",
                f"a Hankel matrix of rank {rank}",
                f"rank {full}: persistently exciting of order {T_ini + N}",
                "too little data, or an input that hardly varies",
            )
    return fit(episodes, meta, B / np.array(_sizes([u @ B.T for u in inputs]))[:, None])


def _sizes(signals: Sequence[Array]) -> tuple[float, ...]:
    """Root mean squares of the components of signals (T, n, dim); 1 where one is always zero."""
    squares = np.concatenate([signal.reshape(-1, signal.shape[2]) for signal in signals]) ** 2
    sizes = np.sqrt(squares.mean(axis=0))
    return tuple(np.where(sizes > 0.0, sizes, 1.0).tolist())
