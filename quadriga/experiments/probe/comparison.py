"""Holds a predictor against the true responses: how wrong it is, and how large what it says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from quadriga.agents.gait import gait_phase
from quadriga.agents.predictor.predictor import Predictor
from quadriga.experiments.probe.pulses import DIRECTIONS
from quadriga.experiments.probe.responses import Responses
from quadriga.shared.config.sections import GaitConfig
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, OUTPUTS, Array

ByOutput = Mapping[str, float | None]  # None where there is nothing to divide by

# Figures of the responses themselves, and of a predictor.
OF_TRUTH: Final = ("peers_share_true", "own_scatter", "peers_scatter")
OF_PREDICTOR: Final = (
    "own_error", "peers_error", "own_size", "peers_size", "peers_share_predicted",
)  # fmt: skip
MEANINGS: Final[Mapping[str, str]] = {
    "own_error": "‖predicted − true‖ / ‖true‖ of the response of the robot that has the pulse",
    "peers_error": "the same of the responses of the other robots",
    "own_size": "‖predicted‖ / ‖true‖ of the response of the robot that has the pulse",
    "peers_size": "the same of the responses of the other robots",
    "peers_share_true": "a peer's true response over the true one of the robot that has the pulse",
    "peers_share_predicted": "a peer's predicted response over the true one of the robot that has "
    "the pulse",
    "own_scatter": "standard deviation of a true response between worlds, over its mean",
    "peers_scatter": "the same of the responses of the other robots",
}


@dataclass(frozen=True, slots=True)
class ResponseComparison:
    """A predictor's figures, each by output, over all pulses and samples that it concerns.

    Attributes:
        overall: figure by its name and output.
        by_phase: the same for the pulses of each phase of the gait.
        by_direction: the same for the pulses of each direction.
        by_pair: by responding robot i and pulsed robot j, index [i][j], error, size and share of
            the true response of i in that of j itself.
    """

    overall: Mapping[str, ByOutput]
    by_phase: tuple[Mapping[str, ByOutput], ...]
    by_direction: Mapping[str, Mapping[str, ByOutput]]
    by_pair: tuple[tuple[Mapping[str, ByOutput], ...], ...]


def compare(true: Array, predicted: Array) -> ResponseComparison:
    """Hold predicted responses against the true ones, both shaped as `Responses.y`."""
    n, phases = true.shape[1], len(true)
    return ResponseComparison(
        overall=_figures(true, predicted),
        by_phase=tuple(_figures(true[p : p + 1], predicted[p : p + 1]) for p in range(phases)),
        by_direction={
            name: _figures(true[:, :, d : d + 1], predicted[:, :, d : d + 1])
            for d, name in enumerate(DIRECTIONS)
        },
        by_pair=tuple(
            tuple(_pair_figures(true[:, j], predicted[:, j], i, j) for j in range(n))
            for i in range(n)
        ),
    )


def predict_responses(responses: Responses, predictor: Predictor, gait: GaitConfig) -> Array:
    """What a predictor says the pulses do, as `Responses.y`.

    The past is the same with and without the pulse, so only the forces of the horizon count.

    Args:
        responses: which pulses.
        predictor: of this team.
        gait: of the walks that were pulsed; the predictor's data may have stood longer.
    """
    meta = predictor.meta
    phases, n, directions, N, _ = responses.u.shape
    predicted = np.empty((phases, n, directions, N, n, N_OUTPUTS))
    for p, tick in enumerate(responses.ticks.tolist()):
        z = np.zeros((n, meta.layout.width, n, directions))
        for j in range(n):
            z[j, meta.layout.past :, j] = responses.u[p, j].reshape(directions, N * N_FORCES).T
        phase = gait_phase(tick, gait.stand_ms, gait.stance_ms, predictor.phases)
        y = predictor.predict(z.reshape(n, meta.layout.width, -1), phase)
        y = y.reshape(n, N, N_OUTPUTS, n, directions)
        predicted[p] = y.transpose(3, 4, 1, 0, 2)
    return predicted


def truth_figures(responses: Responses) -> Mapping[str, ByOutput]:
    """The figures `OF_TRUTH` by output."""
    (own, peers), (own_off, peers_off) = _split(responses.y), _split(responses.scatter)
    return {
        "peers_share_true": _by_output(_size(peers), _size(own), _pairs_per_robot(own)),
        "own_scatter": _by_output(_size(own_off), _size(own)),
        "peers_scatter": _by_output(_size(peers_off), _size(peers)),
    }


def _figures(true: Array, predicted: Array) -> Mapping[str, ByOutput]:
    """The figures `OF_PREDICTOR` by output, of arrays shaped as `Responses.y`."""
    (own, peers), (own_said, peers_said) = _split(true), _split(predicted)
    return {
        "own_error": _by_output(_size(own_said - own), _size(own)),
        "peers_error": _by_output(_size(peers_said - peers), _size(peers)),
        "own_size": _by_output(_size(own_said), _size(own)),
        "peers_size": _by_output(_size(peers_said), _size(peers)),
        "peers_share_predicted": _by_output(_size(peers_said), _size(own), _pairs_per_robot(own)),
    }


def _pair_figures(true: Array, predicted: Array, i: int, j: int) -> Mapping[str, ByOutput]:
    """Figures of robot i for the pulses of robot j, whose responses have shape (P, D, N, n, 6)."""
    response, said, own = true[..., i, :], predicted[..., i, :], true[..., j, :]
    return {
        "error": _by_output(_size(said - response), _size(response)),
        "size": _by_output(_size(said), _size(response)),
        "share_true": _by_output(_size(response), _size(own)),
    }


def _split(y: Array) -> tuple[Array, Array]:
    """Responses of the pulsed robots and of all others, outputs last, the rest in any order."""
    by_pair = np.moveaxis(y, (1, 4), (0, 1))  # pulsed, responding, …
    own = np.eye(y.shape[1], dtype=np.bool_)
    return by_pair[own], by_pair[~own]


def _size(y: Array) -> Array:
    """Norm over all but the outputs. Shape (6,)."""
    norms: Array = np.sqrt((y**2).sum(axis=tuple(range(y.ndim - 1))))
    return norms


def _pairs_per_robot(own: Array) -> int:
    """How many peers a robot has, where `own` holds all robots' responses to their own pulses."""
    return max(1, len(own) - 1)


def _by_output(size: Array, of: Array, times: int = 1) -> ByOutput:
    """The root of the mean square of one size over that of another, `times` as numerous."""
    ratio = np.divide(size, of * np.sqrt(times), out=np.full(N_OUTPUTS, np.nan), where=of > 0.0)
    return {
        name: float(value) if np.isfinite(value) else None
        for name, value in zip(OUTPUTS, ratio, strict=True)
    }
