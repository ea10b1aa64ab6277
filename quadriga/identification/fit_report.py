"""What `quadriga fit` tells of predictors: figures, tables, a page, and the file that is kept."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

from quadriga.agents.planner.acceptance import gates_in_force
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.fits import FITS
from quadriga.agents.predictor.gates import (
    LEFT_OUT,
    UNDERSTATED,
    Bounds,
    GateReport,
    PeersFigures,
    squared_errors,
)
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.store import Provenance, predictor_sha256, read, save
from quadriga.charts.colours import PALETTE
from quadriga.charts.draw import add_beside, tidy_axes
from quadriga.charts.files import save_png
from quadriga.charts.panels import BESIDE
from quadriga.identification.cache import predictor_path
from quadriga.identification.dataset import Dataset, check_excitation
from quadriga.identification.predictors import ensure_data, fit_now, judge_now, reason, refusal
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import OUTPUTS, Array, robot_names
from quadriga.shared.runtime.atomic import write_text
from quadriga.shared.runtime.clock import monotonic
from quadriga.shared.topics import SAMPLE_MS
from quadriga.tables import (
    LABELS,
    NOTHING,
    UNITS,
    Table,
    format_number,
    format_output,
    print_tables,
)

_SHOWN: Final = 5  # samples of the horizon that a terminal shows


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


def horizon_errors(predictor: Predictor, held_out: Sequence[Episode]) -> HorizonErrors:
    """Errors at each sample of the horizon over all windows of the held-out episodes.

    Raises:
        PredictorError: no held-out episode is long enough for a window.
    """
    _, squares, naive = squared_errors(predictor, held_out)
    return HorizonErrors(np.sqrt(squares), np.sqrt(naive))


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
        check_excitation(config, dataset.training)
        begun = monotonic()
        try:
            predictor = fit_now(config, dataset)
        except PredictorError as error:
            return Unfit(name, error)
        seconds = monotonic() - begun
        origin = judge_now(config, dataset, predictor)
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


def build_report_tables(report: FitReport, *, whole: bool = False) -> list[Table]:
    """Everything about one predictor; `whole`: with the errors at every sample of the horizon."""
    N = report.meta.N
    shown = np.arange(N) if whole else np.linspace(0, N - 1, min(N, _SHOWN)).round().astype(int)
    peers = report.gates.peers
    return [
        _build_figures(report),
        _build_outputs(report),
        *([] if peers is None else [_build_peers(peers)]),
        _build_horizon(report, shown.tolist()),
        _build_coupling(report),
    ]


def build_comparison(reports: Sequence[FitReport | Unfit]) -> Table:
    """Several predictors fitted to the same data, a row for each."""
    columns = (
        "predictor", *LABELS, "error", "height gains", "radius / limit", "condition", "MB",
        "fit [s]", "verdict",
    )  # fmt: skip
    rows = [_build_row(report, len(columns)) for report in reports]
    fitted = [report for report in reports if isinstance(report, FitReport)]
    notes = []
    if fitted:
        gates = fitted[0].gates
        held = [format_output(name, gates.rmse_persistence[name]) for name in OUTPUTS]
        rows.append(("persistence", *held, "1", *(NOTHING,) * (len(columns) - 2 - len(held))))
        low, high = gates.gain_limits
        notes.append(
            f"RMSE over the horizon on {gates.windows} held-out windows, all robots; error: of all "
            f"outputs, scaled, over that of persistence (limit 1); limits of height gains "
            f"{low:g} … {high:g}; radius: of the map of the robots' best responses."
        )
    notes += [f"{r.name}: {_describe_verdict(r)}." for r in reports if r.refused]
    notes += [f"{r.name}, effect of peers: {_describe_peers(r)}." for r in fitted]
    return Table("Predictors on the same data: held-out RMSE", columns, tuple(rows), notes)


def _build_row(report: FitReport | Unfit, width: int) -> tuple[str, ...]:
    if isinstance(report, Unfit):
        return (report.name, *(NOTHING,) * (width - 2), "no fit")
    gates = report.gates
    gains = [gain for row in gates.gains for gain in row]
    return (
        report.name,
        *(format_output(name, gates.rmse[name]) for name in OUTPUTS),
        format_number(gates.error),
        f"{min(gains):.2f} … {max(gains):.2f}",
        f"{format_number(gates.radius)} / {gates.radius_limit:g}",
        format_number(gates.condition, ".2g"),
        format_number(gates.size, ".1f", 1e-6),
        format_number(report.fit_seconds, ".1f"),
        "refused" if report.refused else "accepted",
    )


def _describe_verdict(report: FitReport | Unfit) -> str:
    return f"refused: {reason(report.refused)}" if report.refused else "accepted"


def _describe_peers(report: FitReport) -> str:
    peers = report.gates.peers
    return NOTHING if peers is None else peers.describe() or "nothing invented or left out"


def _build_figures(report: FitReport) -> Table:
    gates, origin, meta = report.gates, report.provenance, report.meta
    low, high = gates.gain_limits
    seconds = [0.001 * SAMPLE_MS * sum(samples) for samples in (origin.samples, origin.held_out)]
    rows = [
        ("verdict", _describe_verdict(report), ""),
        ("held-out error / persistence", format_number(gates.error), "< 1"),
        *(
            (
                f"height gain at {time:g} s, {robot}",
                format_number(gain, ".2f"),
                f"{low:g} … {high:g}",
            )
            for k, time in enumerate(gates.gain_times)
            for robot, gain in zip(_list_robots(report), (r[k] for r in gates.gains), strict=True)
        ),
        (f"{gates.iteration} radius", format_number(gates.radius), f"< {gates.radius_limit:g}"),
        ("effect of peers", _describe_peers(report), ""),
        ("condition number", format_number(gates.condition, ".3g"), ""),
        ("size of G", f"{format_number(gates.size, '.1f', 1e-6)} MB", ""),
        ("fit", f"{format_number(report.fit_seconds, '.1f')} s", ""),
        ("data", f"{sum(origin.samples)} samples ({seconds[0]:.0f} s), {seconds[1]:.0f} s held out",
         ""),
        ("episodes", f"{len(origin.seeds)}, seeds {_format_ranges(origin.seeds)}", ""),
        ("horizon", f"N = {meta.N}, T_ini = {meta.T_ini}, {meta.phases} phases", ""),
        ("configuration of the data", origin.config_digest[:16], ""),
        ("digest", report.sha256[:16], ""),
    ]  # fmt: skip
    title = f"Predictor {report.name}, {meta.robots} robots"
    return Table(title, ("figure", "value", "limit"), tuple(rows))


def _build_outputs(report: FitReport) -> Table:
    gates = report.gates
    rows = []
    for name, label in zip(OUTPUTS, LABELS, strict=True):
        rmse, held = gates.rmse[name], gates.rmse_persistence[name]
        ratio = format_number(rmse / held if held else None, ".2f")
        rows.append((label, format_output(name, rmse), format_output(name, held), ratio))
    columns = ("output", "RMSE", "persistence", "ratio")
    note = f"All robots, {gates.windows} held-out windows of {report.meta.N} samples."
    return Table("Held-out error", columns, tuple(rows), (note,))


def _build_peers(peers: PeersFigures) -> Table:
    rows = tuple(
        (
            label,
            format_number(peers.share[name], ".3f"),
            _format_bounds(peers.slope[name], ".2f"),
            _format_bounds(peers.harm[name], ".1f", 100.0),
            peers.verdict(name),
        )
        for name, label in zip(OUTPUTS, LABELS, strict=True)
    )
    columns = ("output", "of the own", "measured / predicted", "more squared error [%]", "verdict")
    notes = (
        "Part of held-out predictions that is due to the forces of peers: its size for one peer "
        "over that of the robot's own forces; how much of it is measured, and how much larger the "
        "squared error is with it than without it, with 95 % intervals. Invented: certainly worse "
        f"than without. Understated: certainly {UNDERSTATED:g} times as much is measured. "
        f"Left out: smaller than {LEFT_OUT:g} of the own. Confirmed: certainly better with it.",
        f"Limit of a planner whose agents respond to each other's plans: certainly more than "
        f"{100.0 * peers.harm_limit:g} % is refused.",
    )
    return Table("Effect of peers", columns, rows, notes)


def _format_bounds(bounds: Bounds, digits: str, factor: float = 1.0) -> str:
    value, low, high = (format_number(number, digits, factor) for number in bounds)
    return value if bounds.low is None else f"{value} ({low} … {high})"


def _build_horizon(report: FitReport, samples: Sequence[int]) -> Table:
    errors = report.horizon
    rows = [
        (
            f"{SAMPLE_MS * (k + 1)} ms",
            *(
                f"{format_output(name, errors.rmse[k, i])} / "
                f"{format_output(name, errors.persistence[k, i])}"
                for i, name in enumerate(OUTPUTS)
            ),
        )
        for k in samples
    ]
    return Table("RMSE / persistence over the horizon", ("ahead", *LABELS), tuple(rows))


def _build_coupling(report: FitReport) -> Table:
    table = report.gates.coupling
    rows = tuple(
        (robot, *(format_number(norm) for norm in row))
        for robot, row in zip(_list_robots(report), table, strict=True)
    )
    note = "Frobenius norms of the scaled G_ij: what robot j (column) does to robot i (row)."
    return Table("Coupling", ("", *_list_robots(report)), rows, (note,))


def _list_robots(report: FitReport) -> tuple[str, ...]:
    return robot_names(report.meta.robots)


def _format_ranges(numbers: Sequence[int]) -> str:
    """Ascending numbers, runs of neighbours shortened: 1000–1003, 1005."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1] = [runs[-1][0], number]
        else:
            runs.append([number])
    return ", ".join("–".join(map(str, run)) for run in runs) or NOTHING


def draw(reports: Sequence[FitReport], path: Path) -> None:
    """Write the figure of predictors of one horizon, fitted to the same data."""
    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True)
    for i, panel in enumerate(axes.flat):
        factor = UNITS[OUTPUTS[i]][1]
        for report in reports:
            errors = report.horizon
            ahead = SAMPLE_MS * np.arange(1, len(errors.rmse) + 1)
            label = f"{report.name} (refused)" if report.refused else report.name
            panel.plot(
                ahead,
                factor * errors.rmse[:, i],
                linewidth=1.3,
                label=label,
                linestyle=":" if report.refused else "-",
            )
        if reports:
            held = factor * reports[0].horizon.persistence[:, i]
            panel.plot(
                ahead,
                held,
                color=PALETTE["soft"],
                linewidth=1.0,
                linestyle="--",
                label="persistence",
            )
        panel.set_ylabel(f"RMSE {LABELS[i]}")
        panel.set_ylim(bottom=0.0)
        tidy_axes(panel)
        beside = BESIDE[i]
        if beside is not None:
            add_beside(panel, beside[0] / factor, beside[1])
    for panel in axes[-1]:
        panel.set_xlabel("ahead [ms]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    figure.suptitle(
        "Errors of predictors over the horizon, on held-out data", x=0.01, ha="left", weight="bold"
    )
    save_png(figure, path)
