"""The tables of fit reports: one predictor in detail, or several beside each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from quadriga.agents.predictor.gates import LEFT_OUT, UNDERSTATED, Bounds, PeersFigures
from quadriga.identification.fit_report import FitReport, Unfit, reason
from quadriga.shared.robot.conventions import OUTPUTS, robot_names
from quadriga.shared.wire.topics import SAMPLE_MS
from quadriga.tables import LABELS, NOTHING, Table, format_number, format_output

_SHOWN = 5  # samples of the horizon that a terminal shows


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
