"""The predictors of a campaign: collected for and fitted once each, before anybody walks."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.identification.cache import data_path, predictor_path
from quadriga.identification.predictors import ensure_data, ensure_predictor, reason
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, PredictorFileError
from quadriga.shared.planner_kinds import find_kind


@dataclass(frozen=True, slots=True)
class Fitted:
    """The predictor of a group, or why there is none.

    Attributes:
        path: its file; None without a planner, or if it is refused.
        sha256: its digest; empty without one.
        data: the file of what it was fitted to, if the planner needs that too.
        refused: why it must not walk; empty if it may.
        radius: of the iteration of the agents' plans; None where they do not use their peers'.
    """

    path: Path | None = None
    sha256: str = ""
    data: Path | None = None
    refused: str = ""
    radius: float | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """What a worker needs."""
        return tuple(file for file in (self.path, self.data) if file is not None)


def prepare_predictors(configs: Iterable[Config], console: Console) -> dict[Config, Fitted]:
    """The predictor of each configuration, from the cache or made now.

    Raises:
        PredictorFileError: a file cannot be read or written; all else refuses a predictor alone.
    """
    fitted: dict[Config, Fitted] = {}
    made: dict[tuple[Path, str], Fitted] = {}
    for config in configs:
        kind = find_kind(config.planner.kind)
        if kind.needs_data:
            ensure_data(config, console)
        if not kind.needs_predictor:
            fitted[config] = Fitted(data=data_path(config) if kind.needs_data else None)
            continue
        # Gates are those of the planner, whose QP any of its keys may change, with the limits of
        # the configuration.
        key = (predictor_path(config), repr((config.planner, config.identification)))
        if key not in made:
            made[key] = _prepare(config, console)
        fitted[config] = made[key]
    return fitted


def file_sha256(path: Path) -> str:
    """Digest of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _prepare(config: Config, console: Console) -> Fitted:
    try:
        path = ensure_predictor(config, console)
        predictor, provenance = load_checked(path, config)
    except PredictorFileError:
        raise  # of which no other predictor is to blame
    except PredictorError as error:
        return Fitted(refused=reason(error))
    kind = find_kind(config.planner.kind)
    return Fitted(
        path,
        predictor_sha256(predictor),
        data_path(config) if kind.needs_data else None,
        radius=float(f"{provenance.gates.radius:.6g}") if kind.needs_peers else None,
    )
