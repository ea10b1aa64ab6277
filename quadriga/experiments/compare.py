"""The command `compare`: planners and predictors in the same worlds, on the same data."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import Final

from rich.console import Console

from quadriga.agents.predictor.store import versions
from quadriga.experiments.compare_figure import draw
from quadriga.experiments.compare_sheets import comparison_sheets
from quadriga.experiments.trial.trial import TrialResult, figures
from quadriga.experiments.trial.trial_job import walked
from quadriga.experiments.trial.trial_walk import over_the_bus
from quadriga.experiments.trial.trials import Choice, Trial, config_of, trials
from quadriga.experiments.trial.variants import PREDICTORS, with_keys
from quadriga.identification.cache import predictor_path
from quadriga.identification.dataset import Dataset
from quadriga.identification.fit import report_fit, write_json
from quadriga.identification.fit_report import FitReport, Unfit, reason, refusal
from quadriga.identification.fit_tables import comparison as predictor_sheet
from quadriga.identification.predictors import ensure_data
from quadriga.progress import build_progress
from quadriga.shared.config.sections import CENTRAL, Config
from quadriga.shared.config.write import config_sha256, to_toml
from quadriga.shared.errors import (
    ConfigError,
    PredictorError,
    PredictorFileError,
    ProcessError,
    QuadrigaError,
)
from quadriga.tables import Table, print_tables
from quadriga.team.run_folder import CONFIG
from quadriga.warm_up import warm_up
from quadriga.workers import run_each

Reports = dict[str, FitReport | Unfit]

RESULTS: Final = "compare.json"
PAGE: Final = "compare.md"
FIGURE: Final = "compare.png"
DISTRIBUTED: Final = "distributed"  # the kind of planner that every gate is for


@dataclass(frozen=True, slots=True)
class ComparisonJob:
    """A trial with the configuration it is walked with and the file of its predictor."""

    trial: Trial
    config: Config
    predictor: Path | None
    sha256: str


def run(
    config: Config, choice: Choice, out: Path, *, jobs: int, bus: bool, console: Console
) -> None:
    """Walk every trial; show the tables, keep them with all figures in the folder `out`.

    Args:
        config: of the team, and everything that is not compared.
        choice: what to compare.
        out: a new folder.
        jobs: processes that walk side by side.
        bus: walk each trial as processes of its own over the bus, one trial after the other.
        console: for progress; the tables go to stdout.

    Raises:
        ConfigError: the folder holds a comparison, or cannot be made.
        PredictorError: there are too little data, or they are not exciting.
        ProcessError: some trials failed; the rest is kept.
    """
    make_folder(out)
    dataset = ensure_data(config, console)
    warm_up(config, console)
    wanted = trials(config, choice)
    names = dict.fromkeys(trial.predictor for trial in wanted if trial.predictor)
    with console.status(f"fitting the predictors {', '.join(names)}"):
        reports = {name: _fitted(config, dataset, name) for name in names}
    rows, jobs_left = _split(config, wanted, reports)
    found = _one_by_one(jobs_left, out) if bus else _side_by_side(jobs_left, jobs)
    try:
        with (
            closing(found),
            build_progress(
                console, "{task.completed}/{task.total} trials", elapsed=True, hidden=False
            ) as progress,
        ):
            for row in progress.track(found, len(jobs_left), description="walking"):
                rows.append(row)
    finally:  # an interrupt must not cost what has been walked
        order = {trial: k for k, trial in enumerate(wanted)}
        rows.sort(key=lambda row: order[row.trial])
        sheets = [predictor_sheet(list(reports.values())), *comparison_sheets(rows)]
        _keep(config, out, rows, reports, sheets)
    print_tables(sheets)
    if failed := [row for row in rows if row.failed]:
        raise ProcessError(
            f"{len(failed)} of {len(rows)} trials",
            failed[0].failed,
            "figures",
            f"the notes in {out / PAGE} name each",
        )
    console.print(f"comparison: {out}", markup=False, highlight=False)


def _fitted(config: Config, dataset: Dataset, name: str) -> FitReport | Unfit:
    """The report of a predictor, which is kept if any planner may use it."""
    mine = with_keys(config, PREDICTORS[name])
    report = report_fit(with_keys(mine, {"planner.kind": CENTRAL[0]}), dataset, name)
    if isinstance(report, Unfit):
        return report
    return replace(report, refused=refusal(report.gates, DISTRIBUTED))


def make_folder(out: Path) -> None:
    """Make the folder of a comparison.

    Raises:
        ConfigError: it holds a comparison already, or cannot be made.
    """
    if (out / RESULTS).exists():
        raise ConfigError(f"--out {out}", "a folder with a comparison", "a new folder")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError(f"--out {out}", reason, "a folder that can be made") from None


def _split(
    config: Config, wanted: Sequence[Trial], reports: Reports
) -> tuple[list[TrialResult], list[ComparisonJob]]:
    """Rows of the trials whose predictor is refused, and jobs of all others."""
    rows, todo = [], []
    for trial in wanted:
        mine = config_of(config, trial)
        report = reports.get(trial.predictor)
        refused = None if report is None else report.refused
        if isinstance(report, FitReport):
            refused = refusal(report.gates, mine.planner.kind)
        if refused is not None:
            rows.append(TrialResult(trial, refused=reason(refused)))
        elif isinstance(report, FitReport):
            todo.append(ComparisonJob(trial, mine, predictor_path(mine), report.sha256))
        else:
            todo.append(ComparisonJob(trial, mine, None, ""))
    return rows, todo


def _side_by_side(todo: Sequence[ComparisonJob], jobs: int) -> Generator[TrialResult, None, None]:
    for _, row in run_each(walk_alone, todo, jobs):
        yield row


def walk_alone(job: ComparisonJob) -> TrialResult:
    """Walk a trial in this process."""
    try:
        return TrialResult(job.trial, walked(job.config, job.predictor))
    except QuadrigaError as error:
        return _unwalked(job.trial, error)


def _one_by_one(todo: Sequence[ComparisonJob], out: Path) -> Generator[TrialResult, None, None]:
    for job in todo:
        name = "-".join(filter(None, (*astuple(job.trial)[:3], str(job.trial.seed))))
        try:
            walk = over_the_bus(job.config, out / name, job.predictor, job.sha256)
            yield TrialResult(job.trial, figures(walk))
        except QuadrigaError as error:
            yield _unwalked(job.trial, error)


def _unwalked(trial: Trial, error: QuadrigaError) -> TrialResult:
    """The row of a trial that came to nothing: DeePC may refuse the data, all else has failed."""
    if isinstance(error, PredictorError) and not isinstance(error, PredictorFileError):
        return TrialResult(trial, refused=reason(error))
    return TrialResult(trial, failed=str(error))


def _keep(
    config: Config,
    out: Path,
    rows: Sequence[TrialResult],
    reports: Reports,
    sheets: Sequence[Table],
) -> None:
    write_json(
        out / RESULTS,
        {
            "config_sha256": config_sha256(config),
            "versions": versions(),
            "predictors": {name: report.to_dict() for name, report in reports.items()},
            "trials": [row.to_dict() for row in rows],
        },
    )
    (out / CONFIG).write_text(to_toml(config), encoding="utf-8")
    draw(rows, out / FIGURE)
    parts = ["# Planners and predictors\n", *(sheet.to_markdown() for sheet in sheets)]
    parts.append(f"![Figures of each trial]({FIGURE})\n")
    (out / PAGE).write_text("\n".join(parts), encoding="utf-8")
