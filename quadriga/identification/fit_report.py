"""What `quadriga fit` tells of predictors: figures, tables, a page, and the files that are kept."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

from quadriga.agents.predictor.gates import (
    GAIN_TIMES,
    GateReport,
    Provenance,
    coupling_table,
    held_out_error,
    radius_limit,
)
from quadriga.agents.predictor.predictor import KINDS, Predictor
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.charts.colours import PALETTE
from quadriga.charts.draw import add_beside, tidy_axes
from quadriga.charts.files import save_png
from quadriga.charts.panels import BESIDE
from quadriga.identification.cache import predictor_path
from quadriga.identification.dataset import Dataset, check_excitation
from quadriga.identification.predictors import ensure_data, fit_or_read, reason, refusal
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.robots.conventions import OUTPUTS, Array, robot_names
from quadriga.shared.runtime.atomic import write_text
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


@dataclass(frozen=True, slots=True)
class FitReport:
    """A fitted predictor as a researcher sees it.

    Attributes:
        name: of the predictor.
        config: whose limits its gates have.
        predictor: itself.
        provenance: what it was fitted to, with the figures it was held against its gates with.
        rmse: held-out errors by sample of the horizon and output, all robots, shape (N, 6), m, m/s,
            m/s, rad, rad, rad/s.
        persistence: those of holding the last measured output, shape (N, 6).
        refused: the gate that refused it for the configured planner, with the figure that did;
            None: it was accepted.
    """

    name: str
    config: Config
    predictor: Predictor
    provenance: Provenance
    rmse: Array
    persistence: Array
    refused: PredictorError | None

    @property
    def gates(self) -> GateReport:
        """The figures that the gates look at."""
        return self.provenance.gates

    @property
    def megabytes(self) -> float:
        """Memory of the predictor."""
        return 1e-6 * sum(array.nbytes for array in self.predictor.arrays().values())

    @property
    def verdict(self) -> str:
        """Whether it was accepted, and if not, why."""
        return f"refused: {reason(self.refused)}" if self.refused else "accepted"

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can carry."""
        errors = (("rmse", self.rmse), ("persistence", self.persistence))
        return {
            "predictor": self.name,
            "sha256": predictor_sha256(self.predictor),
            "refused": reason(self.refused),
            "meta": self.predictor.meta.to_dict(),
            "provenance": asdict(self.provenance),
            "coupling": coupling_table(self.predictor).tolist(),
            "sample_ms": SAMPLE_MS,
            "horizon": {
                name: dict(zip(OUTPUTS, table.T.tolist(), strict=True)) for name, table in errors
            },
        }


@dataclass(frozen=True, slots=True)
class Unfit:
    """A predictor that could not be fitted at all, and why."""

    name: str
    refused: PredictorError

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can carry."""
        return {"predictor": self.name, "refused": reason(self.refused)}


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
    dataset, path, mine = ensure_data(config, console), predictor_path(config), None
    check_excitation(config, dataset.training)
    reports = []
    for kind in KINDS if every else [config.identification.predictor]:
        chosen = replace(config.identification, predictor=kind)
        reports.append(report_fit(replace(config, identification=chosen), dataset, kind, console))
        if kind == config.identification.predictor:
            mine = reports[-1]
    if every:
        sheets = [build_comparison(reports)]
        stem, title = path.with_name(f"{path.stem}-all"), "Predictors"
        write_json(stem.with_suffix(".json"), [report.to_dict() for report in reports])
    else:
        stem, title, (one,) = path.with_suffix(""), f"Predictor {reports[0].name}", reports
        sheets = build_report_tables(one) if isinstance(one, FitReport) else []
    figure = stem.with_suffix(".png")
    draw([report for report in reports if isinstance(report, FitReport)], figure)
    parts = [f"# {title}\n", *(sheet.to_markdown() for sheet in sheets)]
    parts.append(f"![Held-out error over the horizon]({figure.name})\n")
    write_text(stem.with_suffix(".md"), "\n".join(parts))
    print_tables(sheets)
    if mine is not None and mine.refused:
        raise mine.refused
    return path


def report_fit(config: Config, dataset: Dataset, name: str, console: Console) -> FitReport | Unfit:
    """The report of the predictor of `config`, fitted now unless it is kept already.

    Its figures are written beside it, and where it would have been if it was refused.
    """
    try:
        predictor, provenance = fit_or_read(config, console, dataset)
    except PredictorError as error:
        return Unfit(name, error)
    rmse, persistence, _ = held_out_error(predictor, dataset.held_out)
    refused = refusal(provenance.gates, config)
    report = FitReport(name, config, predictor, provenance, rmse, persistence, refused)
    write_json(predictor_path(config).with_suffix(".json"), report.to_dict())
    return report


def write_json(path: Path, body: Any) -> None:
    """Keep figures for other programs."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(body, indent=2, ensure_ascii=False) + "\n")


def overall(errors: Array) -> list[float]:
    """RMSE of each output over the horizon, from those by sample, (N, 6)."""
    overall: list[float] = np.sqrt((errors**2).mean(axis=0)).tolist()
    return overall


def build_report_tables(report: FitReport) -> list[Table]:
    """Everything about one predictor but its errors by sample of the horizon."""
    N, robots = len(report.rmse), robot_names(report.predictor.layout.agents)
    harm = report.gates.harm
    outputs = [
        (
            label,
            format_output(name, rmse),
            format_output(name, held),
            format_number(rmse / held if held else None, ".2f"),
            "{:.1f} ({:.1f} … {:.1f})".format(*(100.0 * x for x in harm[name]))
            if name in harm
            else NOTHING,
        )
        for name, label, rmse, held in zip(
            OUTPUTS, LABELS, overall(report.rmse), overall(report.persistence), strict=True
        )
    ]
    coupling = [
        (robot, *map(format_number, row))
        for robot, row in zip(robots, coupling_table(report.predictor).tolist(), strict=True)
    ]
    note = (
        f"All robots, held-out windows of {N} samples. By peers: how much "
        "larger the squared error is with the predicted effect of the peers' forces than without "
        "it, with a 95 % interval. Of a planner whose agents respond to each other's plans, "
        f"certainly more than {100.0 * report.config.identification.max_peers_harm:g} % is refused."
    )
    norms = "Frobenius norms of the scaled G_ij: what robot j (column) does to robot i (row)."
    columns = ("output", "RMSE", "persistence", "ratio", "by peers [%]")
    return [
        _build_figures(report, robots),
        Table("Held-out error", columns, tuple(outputs), (note,)),
        Table("Coupling", ("", *robots), tuple(coupling), (norms,)),
    ]


def build_comparison(reports: Sequence[FitReport | Unfit]) -> Table:
    """Several predictors fitted to the same data, a row for each."""
    columns = ("predictor", *LABELS, "error", "height gains", "radius", "MB", "fit [s]", "verdict")
    rows = []
    for report in reports:
        if isinstance(report, Unfit):
            rows.append((report.name, *(NOTHING,) * (len(columns) - 2), "no fit"))
            continue
        gates, gains = report.gates, [gain for row in report.gates.gains for gain in row]
        rows.append(
            (
                report.name,
                *map(format_output, OUTPUTS, overall(report.rmse)),
                format_number(gates.error),
                f"{min(gains):.2f} … {max(gains):.2f}",
                format_number(gates.radius),
                format_number(report.megabytes, ".1f"),
                format_number(report.provenance.fit_seconds, ".1f"),
                "refused" if report.refused else "accepted",
            )
        )
    notes = [f"{r.name}: refused: {reason(r.refused)}." for r in reports if r.refused]
    for fitted in [report for report in reports if isinstance(report, FitReport)][:1]:
        gates, limits = fitted.gates, fitted.config.identification
        held = [*map(format_output, OUTPUTS, overall(fitted.persistence))]
        rows.append(("persistence", *held, "1", *(NOTHING,) * (len(columns) - 2 - len(held))))
        low, high = limits.gain_range
        notes.insert(
            0,
            f"RMSE over the horizon on held-out windows, all robots; error: of all "
            f"outputs, scaled, over that of persistence (limit 1); limits of height gains "
            f"{low:g} … {high:g}; radius: of the iteration of the robots' plans (limit "
            f"{radius_limit(fitted.config):g}).",
        )
    return Table("Predictors on the same data: held-out RMSE", columns, tuple(rows), notes)


def _build_figures(report: FitReport, robots: Sequence[str]) -> Table:
    gates, origin, predictor = report.gates, report.provenance, report.predictor
    low, high = report.config.identification.gain_range
    layout = predictor.layout
    seconds = [0.001 * SAMPLE_MS * sum(samples) for samples in (origin.samples, origin.held_out)]
    episodes = f"{len(origin.seeds)}, seeds {min(origin.seeds)} … {max(origin.seeds)}"
    rows = [
        ("verdict", report.verdict, ""),
        ("held-out error / persistence", format_number(gates.error), "< 1"),
        *(
            (f"height gain at {time:g} s, {robot}", f"{row[k]:.2f}", f"{low:g} … {high:g}")
            for k, time in enumerate(GAIN_TIMES)
            for robot, row in zip(robots, gates.gains, strict=True)
        ),
        (
            "radius of the iteration of plans",
            format_number(gates.radius),
            f"< {radius_limit(report.config):g}",
        ),
        ("size of G", f"{report.megabytes:.1f} MB", ""),
        ("fit", f"{format_number(origin.fit_seconds, '.1f')} s", ""),
        (
            "data",
            f"{sum(origin.samples)} samples ({seconds[0]:.0f} s), {seconds[1]:.0f} s held out",
            "",
        ),
        ("episodes", episodes, ""),
        ("horizon", f"N = {layout.N}, T_ini = {layout.T_ini}, {predictor.phases} phases", ""),
        ("configuration of the data", origin.config_digest[:16], ""),
        ("digest", predictor_sha256(predictor)[:16], ""),
    ]
    title = f"Predictor {report.name}, {layout.agents} robots"
    return Table(title, ("figure", "value", "limit"), tuple(rows))


def draw(reports: Sequence[FitReport], path: Path) -> None:
    """Write the figure of predictors of one horizon, fitted to the same data."""
    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True)
    for i, panel in enumerate(axes.flat):
        factor = UNITS[OUTPUTS[i]][1]
        for report in reports:
            ahead = SAMPLE_MS * np.arange(1, len(report.rmse) + 1)
            label = f"{report.name} (refused)" if report.refused else report.name
            style = ":" if report.refused else "-"
            panel.plot(ahead, factor * report.rmse[:, i], style, linewidth=1.3, label=label)
        if reports:
            held = factor * reports[0].persistence[:, i]
            panel.plot(ahead, held, "--", color=PALETTE["soft"], linewidth=1.0, label="persistence")
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
    title = "Errors of predictors over the horizon, on held-out data"
    figure.suptitle(title, x=0.01, ha="left", weight="bold")
    save_png(figure, path)
