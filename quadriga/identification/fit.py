"""Fit predictors, and keep reports on them as tables, figures and JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from quadriga.agents.planner.acceptance import gates_in_force, run_gates
from quadriga.agents.predictor.fits import FITS
from quadriga.agents.predictor.fits import fit as fit_predictor
from quadriga.agents.predictor.predictor import PredictorMeta
from quadriga.agents.predictor.store import predictor_sha256, read, save
from quadriga.identification.cache import predictor_path
from quadriga.identification.dataset import Dataset, check_excitation
from quadriga.identification.fit_figure import draw
from quadriga.identification.fit_report import FitReport, Unfit, horizon_errors, refusal
from quadriga.identification.fit_tables import build_comparison, build_report_tables
from quadriga.identification.predictors import build_provenance, ensure_data
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.blas import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic
from quadriga.tables import Table, print_tables


def fit_and_report(config: Config, console: Console, *, every: bool) -> Path:
    """Fit the configured predictor unless there is one, show and keep its report.

    Args:
        config: the team's configuration.
        console: for progress; the report goes to stdout.
        every: do so for each predictor there is, on the same data.

    Returns:
        The file of the configured predictor.

    Raises:
        PredictorError: the data are too little or not exciting, or the configured predictor is
            refused, after the report has been shown.
    """
    dataset, path = ensure_data(config, console), predictor_path(config)
    kinds = list(FITS) if every else [config.identification.predictor]
    reports = []
    for kind in kinds:
        chosen = replace(config.identification, predictor=kind)
        with console.status(f"fitting the predictor {kind}"):
            reports.append(report_fit(replace(config, identification=chosen), dataset, kind))
    mine = reports[kinds.index(config.identification.predictor)]
    if every:
        sheets = whole = [build_comparison(reports)]
        stem = path.with_name(f"{path.stem}-all")
        write_json(stem.with_suffix(".json"), [report.to_dict() for report in reports])
    else:
        stem, sheets, whole = path.with_suffix(""), _sheets(mine), _sheets(mine, True)
    write_page(stem, "Predictors" if every else f"Predictor {mine.name}", whole, reports)
    print_tables(sheets)
    if mine.refused:
        raise mine.refused
    return path


def report_fit(config: Config, dataset: Dataset, name: str) -> FitReport | Unfit:
    """The report of the predictor of `config`, fitted now unless it is kept already.

    An accepted one is kept where walks look for it. Its figures are written beside it, and where
    it would have been if it was refused.

    Raises:
        PredictorError: the data are too little or not exciting, so that nothing can be fitted.
    """
    path, kind = predictor_path(config), config.planner.kind
    if path.is_file():
        predictor, origin = read(path)
        origin = replace(origin, gates=gates_in_force(origin.gates, config, predictor))
        seconds = _read_fit_seconds(path, predictor_sha256(predictor))
    else:
        use_one_blas_thread()
        check_excitation(config, dataset.training)
        begun = monotonic()
        try:
            predictor = fit_predictor(dataset.training, PredictorMeta.of(config))
        except PredictorError as error:
            return Unfit(name, error)
        seconds = monotonic() - begun
        origin = build_provenance(config, dataset, run_gates(config, predictor, dataset.held_out))
        if refusal(origin.gates, kind) is None:
            save(path, predictor, origin)
    errors, digest = horizon_errors(predictor, dataset.held_out), predictor_sha256(predictor)
    refused = refusal(origin.gates, kind)
    report = FitReport(name, digest, predictor.meta, origin, errors, refused, seconds)
    write_json(path.with_suffix(".json"), report.to_dict())
    return report


def write_json(path: Path, body: Any) -> None:
    """Keep figures for other programs."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(body, indent=2, ensure_ascii=False) + "\n")


def write_page(
    stem: Path, title: str, sheets: Sequence[Table], reports: Sequence[FitReport | Unfit]
) -> None:
    """Keep tables as Markdown, and a figure of the errors over the horizon beside them."""
    figure = stem.with_suffix(".png")
    draw([report for report in reports if isinstance(report, FitReport)], figure)
    parts = [f"# {title}\n", *(sheet.to_markdown() for sheet in sheets)]
    parts.append(f"![Held-out error over the horizon]({figure.name})\n")
    write_text(stem.with_suffix(".md"), "\n".join(parts))


def _sheets(report: FitReport | Unfit, whole: bool = False) -> list[Table]:
    return build_report_tables(report, whole=whole) if isinstance(report, FitReport) else []


def _read_fit_seconds(path: Path, digest: str) -> float | None:
    """How long the fit of a stored predictor took, from its report; None without one."""
    try:
        report = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        return float(report["fit_seconds"]) if report["sha256"] == digest else None
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None  # fitted by a walk, which keeps no report
