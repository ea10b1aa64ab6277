"""From configuration to an accepted predictor: collect, fit, gate, keep for later runs."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from quadriga.agents.planner.gates import GateReport, run_gates
from quadriga.agents.planner.team_planner import TeamPlanner, centralised, deepc
from quadriga.agents.predictor.deepc import build_model, reduce
from quadriga.agents.predictor.episode import SIGNALS, Episode
from quadriga.agents.predictor.fits import fit as fit_predictor
from quadriga.agents.predictor.hankel import excitation, required_samples
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, load, save, versions
from quadriga.identification.cache import data_path, predictor_path
from quadriga.identification.collect import Dataset, collect, training_seconds
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import config_sha256
from quadriga.shared.errors import PredictorError, PredictorFileError
from quadriga.shared.robot.a1 import N_FORCES, Array
from quadriga.shared.runtime.blas import one_blas_thread

_FIELDS = (*SIGNALS, "first_tick")


def ensure_predictor(config: Config, console: Console) -> Path:
    """The file of an accepted predictor for `config`; collects and fits if there is none.

    Raises:
        PredictorError: the data are too little or not exciting, or a gate refuses the fit.
    """
    path = predictor_path(config)
    if path.is_file():
        load(path, config)
        return path
    dataset = ensure_data(config, console)
    fit(config, dataset, path, console)
    return path


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
        pass  # that nothing can be kept there is better known before minutes of walking
    seconds = training_seconds(config) + config.identification.held_out
    label = f"collecting {seconds:.0f} s of walking, {config.team.robots} robots"
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total} episodes"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
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
    one_blas_thread()
    check_excitation(config, dataset.training)
    with console.status("fitting the predictor"):
        predictor = fit_predictor(dataset.training, PredictorMeta.of(config))
        report = run_gates(config, predictor, dataset.held_out)
    report.check(config.planner.kind)
    return save(path, predictor, provenance(config, dataset, report)), report


def check_excitation(config: Config, training: Sequence[Episode]) -> None:
    """Enough samples by the rule T ≥ (m+1)(T_ini+N+n)−1, and inputs persistently exciting.

    Raises:
        PredictorError: too few samples, or inputs that leave directions unexcited.
    """
    n, planner = config.team.robots, config.planner
    length = planner.T_ini + planner.N
    order = config.identification.order_per_robot * n
    required = required_samples(N_FORCES * n, planner.T_ini, planner.N, order)
    samples = sum(episode.samples for episode in training)
    if samples < required:
        raise PredictorError(
            "collected data",
            f"{samples} samples",
            f"at least {required} by (m+1)(T_ini+N+n)−1",
            "collect more: identification.seconds, or fewer falls",
        )
    found = excitation([episode.scaled()[0] for episode in training], length + order)
    if not found.persistent:
        raise PredictorError(
            "collected data",
            f"a Hankel matrix of the inputs of rank {found.rank}",
            f"rank {found.rows}: inputs persistently exciting of order {found.order}",
            "more noise (identification.noise) or shorter holds (identification.noise_hold_ms)",
        )


def provenance(config: Config, dataset: Dataset, report: GateReport) -> Provenance:
    """Where a predictor fitted now comes from."""
    return Provenance(
        config_digest=config_sha256(config),
        seeds=dataset.seeds,
        samples=tuple(episode.samples for episode in dataset.training),
        held_out=tuple(episode.samples for episode in dataset.held_out),
        versions=versions(),
        gates=report,
    )


def load_predictor(path: Path, config: Config) -> Predictor:
    """The predictor in a file, if it is for this team and passes its gates.

    Raises:
        PredictorError: see `quadriga.agents.predictor.store.load`.
    """
    return load(path, config)[0]


def write_data(path: Path, dataset: Dataset) -> None:
    """Keep collected data; a file half written never has the name `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {"seeds": np.array(dataset.seeds, dtype=np.int64)} | {
        f"{part}.{k}.{name}": np.asarray(getattr(episode, name))
        for part in ("training", "held_out")
        for k, episode in enumerate(getattr(dataset, part))
        for name in _FIELDS
    }
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    with partial.open("wb") as file:
        np.savez(file, **arrays)
    partial.replace(path)


def read_data(path: Path) -> Dataset:
    """Collected data from a file.

    Raises:
        PredictorFileError: no such file, or not a file of collected data.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        parts: dict[str, tuple[Episode, ...]] = {}
        for part in ("training", "held_out"):
            count = len({name.split(".")[1] for name in arrays if name.startswith(part)})
            parts[part] = tuple(_episode(arrays, f"{part}.{k}") for k in range(count))
        seeds = tuple(arrays["seeds"].tolist())
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise PredictorFileError(
            f"data {path}",
            str(error) or type(error).__name__,
            "a file of `quadriga collect`",
            "delete it to collect anew",
        ) from None
    return Dataset(**parts, seeds=seeds)


def _episode(arrays: dict[str, Array], name: str) -> Episode:
    signals = {signal: arrays[f"{name}.{signal}"] for signal in SIGNALS}
    return Episode(**signals, first_tick=int(arrays[f"{name}.first_tick"]))


def team_planner(config: Config, predictor: Predictor, data: Path | None = None) -> TeamPlanner:
    """The planner of the whole team for a `planner.kind` that is one process for all.

    `data` is the file of what was collected, which DeePC plans with; None takes the cache's.

    Raises:
        PredictorError: the predictor is of another team; there are no collected data for DeePC.
    """
    one_blas_thread()
    if config.planner.kind == "centralised":
        return centralised(config, predictor)
    planner = config.planner
    reduction = reduce(read_data(data or data_path(config)).training, planner.T_ini, planner.N)
    return deepc(config, build_model(reduction, planner, planner.lambda_g, planner.lambda_sigma))
