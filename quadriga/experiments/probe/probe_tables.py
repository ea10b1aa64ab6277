"""The tables of a probe: every predictor's figures beside each other, or one's in detail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from quadriga.experiments.probe.comparison import ByOutput
from quadriga.experiments.probe.outcome import PredictorOutcome, ProbeOutcome
from quadriga.experiments.probe.pulses import DIRECTIONS_TEXT
from quadriga.shared.robots.conventions import OUTPUTS, robot_names
from quadriga.tables import Table, format_number

_OVERALL = (
    ("own_error", "own error"),
    ("peers_error", "peers' error"),
    ("own_size", "own size, predicted / true"),
    ("peers_size", "peers' size, predicted / true"),
    ("peers_share_predicted", "peers' predicted share"),
)
_TRUE = (
    ("peers_share_true", "peers' share"),
    ("own_scatter", "own scatter between worlds"),
    ("peers_scatter", "peers' scatter between worlds"),
)


def build_overall(outcome: ProbeOutcome) -> Table:
    """Figures over all pulses: of the truth, then of each predictor."""
    rows = [(f"truth: {text}", *_cells(outcome.truth[figure])) for figure, text in _TRUE]
    for each in outcome.predictors:
        rows += [
            (f"{each.name}: {text}", *_cells(each.comparison.overall[figure]))
            for figure, text in _OVERALL
        ]
    responses = outcome.responses
    notes = [
        f"{responses.pulses} pulses in worlds of the seeds {', '.join(map(str, responses.seeds))}; "
        f"{responses.lost} lost to falls.",
        "Error: ‖predicted − true‖ / ‖true‖ over all pulses, phases and samples of the horizon: 0 "
        "is perfect, 1 as good as predicting nothing. Share: a peer's response over the true one "
        "of the robot that has the pulse. Scatter: of one world's response, over the mean.",
    ]
    notes += [
        f"{each.name} is refused: {each.refused}." for each in outcome.predictors if each.refused
    ]
    title = f"True response to pulses, and what is predicted: {outcome.title}"
    return Table(title, ("figure", *OUTPUTS), tuple(rows), notes)


def build_details(outcome: ProbeOutcome) -> list[Table]:
    """Each predictor's errors by phase, by direction and by pair of robots."""
    tables = []
    for each in outcome.predictors:
        tables += [_by_phase(outcome, each), _by_direction(each)]
        if outcome.config.team.robots > 1:
            tables.append(_by_pair(outcome, each))
    return tables


def _by_phase(outcome: ProbeOutcome, each: PredictorOutcome) -> Table:
    figures = zip(outcome.phase_ms, each.comparison.by_phase, strict=True)
    rows = _error_rows([(f"{time} ms", figure) for time, figure in figures])
    note = "Own error / peers' error. Time of the pulse in the gait's period."
    return Table(f"{each.name}: errors by phase of the gait", ("phase", *OUTPUTS), rows, (note,))


def _by_direction(each: PredictorOutcome) -> Table:
    rows = _error_rows(list(each.comparison.by_direction.items()))
    notes = ("Own error / peers' error.", f"{DIRECTIONS_TEXT}.")
    return Table(f"{each.name}: errors by direction", ("direction", *OUTPUTS), rows, notes)


def _by_pair(outcome: ProbeOutcome, each: PredictorOutcome) -> Table:
    names = robot_names(outcome.config.team.robots)
    rows = [
        (f"{pulsed} → {responding}", *_pairs(figures["share_true"], figures["error"]))
        for responding, row in zip(names, each.comparison.by_pair, strict=True)
        for pulsed, figures in zip(names, row, strict=True)
        if pulsed != responding
    ]
    note = "True share of the pulsed robot's own response / relative error."
    return Table(
        f"{each.name}: responses of peers", ("pulse → response", *OUTPUTS), tuple(rows), (note,)
    )


def _error_rows(
    figures: Sequence[tuple[str, Mapping[str, ByOutput]]],
) -> tuple[tuple[str, ...], ...]:
    return tuple(
        (name, *_pairs(figure["own_error"], figure["peers_error"])) for name, figure in figures
    )


def _pairs(first: ByOutput, second: ByOutput) -> list[str]:
    return [f"{a} / {b}" for a, b in zip(_cells(first), _cells(second), strict=True)]


def _cells(figure: ByOutput) -> list[str]:
    return [format_number(figure[name], ".3f") for name in OUTPUTS]
