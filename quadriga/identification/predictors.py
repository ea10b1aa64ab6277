"""From configuration to an accepted predictor: collect, fit, gate, keep for later runs."""

from __future__ import annotations

import json
import os
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.agents.predictor.episode import N_WRENCH
from quadriga.agents.predictor.gates import GateReport, Provenance, gates_in_force, read, run_gates
from quadriga.agents.predictor.periodic import DEGREE
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.predictor import fit as fit_predictor
from quadriga.agents.predictor.store import save, versions
from quadriga.identification.cache import data_path, predictor_path
from quadriga.identification.collect import collect, collection_seconds
from quadriga.identification.dataset import Dataset, check_excitation, read_data, write_data
from quadriga.progress import build_progress
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import PredictorError, PredictorFileError, QuadrigaError
from quadriga.shared.robots.conventions import N_OUTPUTS, Array
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.runtime.npz import UNREADABLE, as_measured, open_npz

# What a true response depends on beside the controller: of a predictor's meta, and sections.
_TEAM: Final = (
    "robots", "robot", "yokes", "alternate_phase", "stance_ms", "stand_ms", "interface",
)  # fmt: skip
_PLANT: Final = ("motors", "sensors", "estimator")
Judged = tuple[Predictor, Provenance]  # a predictor and the figures of its gates, whatever they say


def ensure_predictor(config: Config, console: Console) -> Path:
    """The file of an accepted predictor for `config`; collects and fits if there is none.

    Raises:
        PredictorError: the data are too little or not exciting, or a gate refuses the fit.
    """
    fit_or_read(config, console)[1].gates.check(config)
    return predictor_path(config)


def fit_or_read(config: Config, console: Console, dataset: Dataset | None = None) -> Judged:
    """The predictor of `config`, read if it is kept; else fitted, and kept if it is accepted.

    Args:
        config: the team's configuration.
        console: for progress.
        dataset: to fit to; None: the collected data, which are collected if there are none.

    Raises:
        PredictorError: the data are too little or not exciting.
    """
    path = predictor_path(config)
    if path.is_file():
        predictor, provenance = read(path)
        gates = gates_in_force(provenance.gates, config, predictor)
        return predictor, replace(provenance, gates=gates)
    dataset = dataset or ensure_data(config, console)
    with console.status(f"fitting the predictor {config.identification.predictor}"):
        return fit(config, dataset, path)


def ensure_data(config: Config, console: Console) -> Dataset:
    """The collected data for `config`, from the cache or collected now.

    Raises:
        PredictorError: too many walks ended in a fall.
    """
    path = data_path(config)
    if path.is_file():
        return read_data(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=path.parent):
        pass  # a folder that cannot be written is better known before minutes of walking
    label = f"collecting {collection_seconds(config):.0f} s of walking, {config.team.robots} robots"
    count = "{task.completed}/{task.total} episodes"
    with build_progress(console, count, elapsed=True, hidden=False) as progress:
        task = progress.add_task(label, total=None)

        def show(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        dataset = collect(config, os.cpu_count() or 1, show)
    write_data(path, dataset)
    return dataset


def fit(config: Config, dataset: Dataset, path: Path) -> Judged:
    """Fit a predictor, hold it against its gates and, if they accept it, keep it.

    Raises:
        PredictorError: too little data, not exciting, or a singular problem.
        PredictorFileError: configured responses that are missing, or of another team.
    """
    check_excitation(config, dataset.training)
    response = read_response(config)
    use_one_blas_thread()
    begun = monotonic()
    predictor = fit_predictor(dataset.training, PredictorMeta.of(config), response=response)
    provenance = Provenance(
        config_digest=config_sha256(config),
        seeds=dataset.seeds,
        samples=tuple(episode.samples for episode in dataset.training),
        held_out=tuple(episode.samples for episode in dataset.held_out),
        versions=versions(),
        fit_seconds=monotonic() - begun,
        gates=run_gates(config, predictor, dataset.held_out),
    )
    if refusal(provenance.gates, config) is None:
        save(path, predictor, asdict(provenance))
    return predictor, provenance


def measured_team(config: Config) -> dict[str, Any]:
    """What a team's true response depends on, by key, as JSON has it."""
    meta = PredictorMeta.of(config)
    known = {name: getattr(meta, name) for name in _TEAM}
    known |= {f"controller.{key}": value for key, value in meta.controller}
    for section in _PLANT:
        known |= {f"{section}.{k}": v for k, v in asdict(getattr(config, section)).items()}
    team: dict[str, Any] = json.loads(json.dumps(known))
    return team


def read_response(config: Config) -> Array | None:
    """The measured response that stands for a fitted one; None if none is configured.

    Returns:
        Its coefficients, see `fit_periodic`.

    Raises:
        PredictorFileError: no such file, not one of a response, or of another team.
    """
    if not config.response_file:
        return None
    name, path, n = "identification.response", Path(config.response_file), config.team.robots
    try:
        with open_npz(path) as archive:
            response = as_measured("response", archive["response"], 6)
            team = {**json.loads(str(archive["team"]))}
    except UNREADABLE as error:
        got = "no such file" if isinstance(error, FileNotFoundError) else type(error).__name__
        expected = "what `quadriga probe --out DIR` wrote"
        cause = "measure it with the same team"
        raise PredictorFileError(f"{name} {path}", got, expected, cause) from None
    for key, value in measured_team(config).items():
        if team.get(key) != value:
            got = f"responses of a team with {key} = {team.get(key)!r}"
            raise PredictorFileError(name, got, f"{value!r}", "measure it: `quadriga probe`")
    shape = (2 * DEGREE + 2, config.planner.N, n, N_WRENCH, n, N_OUTPUTS)
    if response.shape != shape:
        got = f"a response of shape {response.shape}"
        raise PredictorFileError(name, got, f"{shape}", "another horizon?")
    return response


def refusal(gates: GateReport, config: Config) -> PredictorError | None:
    """The gate that refuses a predictor for the configured planner, None if all accept it."""
    try:
        gates.check(config)
    except PredictorError as error:
        return error
    return None


def reason(refused: QuadrigaError | None) -> str:
    """Why something was refused, in a few words, or ""."""
    if refused is None:
        return ""
    return f"{refused.name.removeprefix('predictor: ')} {refused.got}, not {refused.expected}"
