"""The predictors that are held against the truth: the configured one, others by name, a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from quadriga.agents.predictor.gates import check_fitted_for, gates_in_force, read
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.experiments.variants import PREDICTORS
from quadriga.identification.predictors import fit_or_read, reason, refusal
from quadriga.shared.config.load import build, overlay
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Probed:
    """A predictor that is held against the truth.

    Attributes:
        name: what it is called in tables.
        predictor: itself.
        sha256: its digest.
        refused: why a gate refuses it for the configured planner; empty if none does.
    """

    name: str
    predictor: Predictor
    sha256: str
    refused: str


def configured_predictor(config: Config, console: Console, name: str = "") -> Probed:
    """The predictor of a configuration, fitted now unless it is kept, whatever its gates say.

    Args:
        config: the team's configuration.
        console: for progress.
        name: what it is called; by default as its fit.

    Raises:
        PredictorError: the data are too little or not exciting.
    """
    predictor, provenance = fit_or_read(config, console)
    refused = reason(refusal(provenance.gates, config))
    name = name or config.identification.predictor
    return Probed(name, predictor, predictor_sha256(predictor), refused)


def named_predictors(
    names: Sequence[str], given: dict[str, dict[str, object]], console: Console
) -> list[Probed]:
    """Predictors by their names in a campaign, each with its keys on top of what is given.

    Raises:
        ConfigError: a name is unknown, or stands there twice.
        PredictorError: the data are too little or not exciting.
    """
    for name in names:
        if name not in PREDICTORS:
            raise ConfigError("--predictors", repr(name), f"names of {', '.join(PREDICTORS)}")
    if len(set(names)) < len(names):
        raise ConfigError("--predictors", ", ".join(names), "each once")
    sections = {section: dict(keys) for section, keys in given.items()}
    configs = {name: build(_with_keys(sections, name)) for name in names}
    return [configured_predictor(config, console, name) for name, config in configs.items()]


def predictor_of_file(path: Path, config: Config) -> Probed:
    """The predictor in a file, for the team and the low level of `config`.

    Raises:
        PredictorFileError: no such file, not a predictor, or fitted for another team or low level.
    """
    predictor, provenance = read(path)
    check_fitted_for(config, path, predictor)
    gates = gates_in_force(provenance.gates, config, predictor)
    refused = reason(refusal(gates, config))
    return Probed(path.stem, predictor, predictor_sha256(predictor), refused)


def _with_keys(given: dict[str, dict[str, object]], name: str) -> dict[str, dict[str, object]]:
    copy = {section: dict(keys) for section, keys in given.items()}
    return overlay(copy, PREDICTORS[name])
