"""From configuration to an accepted predictor: collect, fit, gate, keep for later runs."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from rich.console import Console

from quadriga.agents.planner.acceptance import gates_in_force, load_checked, run_gates
from quadriga.agents.predictor.fits import fit as fit_predictor
from quadriga.agents.predictor.gates import GateReport
from quadriga.agents.predictor.measured_response import check_measured_plant
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, read, save, versions
from quadriga.identification.cache import data_path, predictor_path
from quadriga.identification.collect import collect, collection_seconds
from quadriga.identification.dataset import Dataset, check_excitation, read_data, write_data
from quadriga.progress import build_progress
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import PredictorError, QuadrigaError
from quadriga.shared.runtime.arithmetic import use_one_blas_thread


def ensure_predictor(config: Config, console: Console) -> Path:
    """The file of an accepted predictor for `config`; collects and fits if there is none.

    Raises:
        PredictorError: the data are too little or not exciting, or a gate refuses the fit.
    """
    path = predictor_path(config)
    if path.is_file():
        load_checked(path, config)
        return path
    fit(config, ensure_data(config, console), path, console)
    return path


def fit_or_read(config: Config, console: Console) -> tuple[Predictor, GateReport]:
    """The predictor of `config` with the figures of its gates, whatever they say.

    It is read if it is kept. Else it is fitted, to data that are collected if there are none, and
    kept if its gates accept it.

    Raises:
        PredictorError: the data are too little or not exciting.
    """
    path = predictor_path(config)
    if path.is_file():
        predictor, origin = read(path)
        return predictor, gates_in_force(origin.gates, config, predictor)
    dataset = ensure_data(config, console)
    check_excitation(config, dataset.training)
    with console.status(f"fitting the predictor {config.identification.predictor}"):
        predictor = fit_now(config, dataset)
        origin = judge_now(config, dataset, predictor)
    if refusal(origin.gates, config.planner.kind) is None:
        save(path, predictor, origin)
    return predictor, origin.gates


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


def fit(config: Config, dataset: Dataset, path: Path, console: Console) -> tuple[str, GateReport]:
    """Fit a predictor, hold it against its gates and keep it.

    Returns:
        The predictor's digest and the figures it was accepted with.

    Raises:
        PredictorError: too little data, not exciting, or refused by a gate.
    """
    check_excitation(config, dataset.training)
    with console.status("fitting the predictor"):
        predictor = fit_now(config, dataset)
        origin = judge_now(config, dataset, predictor)
    gates = origin.gates
    if gates.peers is not None and (found := gates.peers.describe()):
        console.print(f"effect of peers as predicted: {found}; see `quadriga fit`", highlight=False)
    gates.check(config.planner.kind)
    return save(path, predictor, origin), gates


def fit_now(config: Config, dataset: Dataset) -> Predictor:
    """The predictor of a configuration, fitted to these data.

    Raises:
        PredictorError: too little data, or a singular problem.
        PredictorFileError: configured responses that are missing, or of another team.
    """
    use_one_blas_thread()
    check_measured_plant(config)
    return fit_predictor(dataset.training, PredictorMeta.of(config))


def judge_now(config: Config, dataset: Dataset, predictor: Predictor) -> Provenance:
    """Where a predictor fitted now comes from, with the figures of its gates."""
    return Provenance(
        config_digest=config_sha256(config),
        seeds=dataset.seeds,
        samples=tuple(episode.samples for episode in dataset.training),
        held_out=tuple(episode.samples for episode in dataset.held_out),
        versions=versions(),
        gates=run_gates(config, predictor, dataset.held_out),
    )


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
