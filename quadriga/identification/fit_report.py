"""What a fit came to: its figures against their limits, its error over the horizon, its origin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.gates import GateReport, squared_errors
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance
from quadriga.shared.errors import PredictorError, QuadrigaError
from quadriga.shared.robot.conventions import OUTPUTS, Array
from quadriga.shared.wire.topics import SAMPLE_MS


@dataclass(frozen=True, slots=True)
class HorizonErrors:
    """Held-out root mean square errors by sample of the horizon and output, all robots.

    Attributes:
        rmse: of the predictor, shape (N, 6), m, m/s, m/s, rad, rad, rad/s.
        persistence: of holding the last measured output, shape (N, 6).
    """

    rmse: Array
    persistence: Array

    def to_dict(self) -> dict[str, dict[str, list[float]]]:
        """By output, a number for each sample."""
        return {
            name: dict(zip(OUTPUTS, table.T.tolist(), strict=True))
            for name, table in (("rmse", self.rmse), ("persistence", self.persistence))
        }


@dataclass(frozen=True, slots=True)
class FitReport:
    """A fitted predictor as a researcher sees it.

    Attributes:
        name: of the predictor.
        sha256: digest of the predictor (see `quadriga.agents.predictor.store.predictor_sha256`).
        meta: what it was fitted for, and how.
        provenance: what it was fitted to, with the figures it was held against its gates with.
        horizon: errors at each sample.
        refused: the gate that refused it for the configured planner, with the figure that did;
            None: it was accepted.
        fit_seconds: wall-clock time of the fit alone; None: it was fitted earlier.
    """

    name: str
    sha256: str
    meta: PredictorMeta
    provenance: Provenance
    horizon: HorizonErrors
    refused: PredictorError | None
    fit_seconds: float | None

    @property
    def gates(self) -> GateReport:
        """The figures that the gates look at, and their limits."""
        return self.provenance.gates

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can carry."""
        return {
            "predictor": self.name,
            "sha256": self.sha256,
            "refused": reason(self.refused),
            "fit_seconds": self.fit_seconds,
            "meta": self.meta.to_dict(),
            "provenance": {**asdict(self.provenance), "gates": self.gates.to_dict()},
            "sample_ms": SAMPLE_MS,
            "horizon": self.horizon.to_dict(),
        }


@dataclass(frozen=True, slots=True)
class Unfit:
    """A predictor that could not be fitted at all, and why."""

    name: str
    refused: PredictorError

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can carry."""
        return {"predictor": self.name, "refused": reason(self.refused)}


def refusal(gates: GateReport, kind: str) -> PredictorError | None:
    """The gate that refuses a predictor for a kind of planner, None if all accept it."""
    try:
        gates.check(kind)
    except PredictorError as error:
        return error
    return None


def reason(refused: QuadrigaError | None) -> str:
    """Why something was refused, in a few words, or ""."""
    if refused is None:
        return ""
    return f"{refused.name.removeprefix('predictor: ')} {refused.got}, not {refused.expected}"


def horizon_errors(predictor: Predictor, held_out: Sequence[Episode]) -> HorizonErrors:
    """Errors at each sample of the horizon over all windows of the held-out episodes.

    Raises:
        PredictorError: no held-out episode is long enough for a window.
    """
    _, squares, naive = squared_errors(predictor, held_out)
    return HorizonErrors(np.sqrt(squares), np.sqrt(naive))
