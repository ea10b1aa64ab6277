"""The tables of results: what became of the walks, and each variant beside the baseline."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Final

from quadriga.experiments.measures import MEASURES, format_p, keep_together, name_ratio
from quadriga.experiments.results import ALL, COST, POOLED, Beside, Line, Results, Tally
from quadriga.experiments.statistics import mcnemar
from quadriga.recordings.traces import ERRORS
from quadriga.tables import NOTHING, Table, error_text, format_number, format_output, label_output

POOLED_NOTE: Final = (
    f"{ALL.capitalize()}: pairs of every world together. Where one seed gives similar worlds (the "
    "same boxes, higher) they are not independent, and intervals and p say too much."
)
Column = tuple[str, Callable[[Line], str]]  # its heading, and a line's cell


def _success(line: Line) -> str:
    interval = MEASURES["success"].of(line)
    return NOTHING if interval is None else MEASURES["success"].format_interval(interval)


def _of(read: Callable[[Tally], float | None], digits: str) -> Callable[[Line], str]:
    return lambda line: format_number(read(line.tally), digits)


def _rmse(name: str) -> Callable[[Line], str]:
    return lambda line: format_output(name, line.tally.rmse[name])


def _plans(line: Line) -> str:
    """Shares of the plans' statuses, most frequent first."""
    plans = line.tally.plans
    total = sum(plans.values())
    ranked = sorted(plans.items(), key=lambda item: -item[1])
    shares = (keep_together(f"{name} {100 * count / total:.3g} %") for name, count in ranked)
    return ", ".join(shares) or NOTHING


COLUMNS: Final[Mapping[str, Column]] = {
    "trials": ("trials", lambda line: f"{line.tally.trials:,}"),
    "success": ("success [%]", _success),
    "falls": ("falls", lambda line: str(line.tally.falls)),
    "stops": ("stops", lambda line: str(line.tally.stops)),
    "time-to-fall": ("time to fall [s]", _of(lambda tally: tally.time_to_fall, ".2f")),
    "vx": ("mean vx [m/s]", _of(lambda tally: tally.mean_vx, ".3f")),
    "transport": ("cost of transport", _of(lambda tally: tally.cost_of_transport, ".2f")),
    "cost": ("control cost", _of(lambda tally: tally.control_cost, ".0f")),
    "p50": ("plan p50 [ms]", _of(lambda tally: tally.planner_ms_p50, ".2f")),
    "p99": ("p99 [ms]", _of(lambda tally: tally.planner_ms_p99, ".2f")),
    "plans": ("plans", _plans),
    "radius": ("radius", lambda line: format_number(line.radius, ".2f")),
    **{f"rmse-{name}": (f"RMSE {label_output(name)}", _rmse(name)) for name in ERRORS},
}


def build_walks_table(results: Results, names: Sequence[str], title: str = "Walks") -> Table:
    """What became of each variant's walks: some of `COLUMNS`, by name."""
    columns = [COLUMNS[name] for name in names]
    head = [heading for heading, _ in columns]
    return _build(title, results, results.lines, head, lambda ln: [cell(ln) for _, cell in columns])


def build_falls_table(results: Results) -> Table:
    """Falls of every other variant beside the baseline's."""
    base = results.baseline
    head = (
        "pairs",
        "falls",
        f"of {base}",
        "alone",
        f"{base} alone",
        "difference [points]",
        "McNemar p",
    )
    return _build(f"Falls against {base}", results, _select_compared(results), head, _falls)


def build_ratios_table(results: Results, names: Sequence[str]) -> Table:
    """Errors of every other variant over the baseline's: of `COST` and some of `ERRORS`."""
    head = [f"RMSE {error_text(name)}" if name != COST else "control cost" for name in names]
    title = f"Errors over those of {results.baseline}"
    lines = _select_compared(results)
    return _build(title, results, lines, ["pairs", *head], lambda line: _ratios(line, names))


def _select_compared(results: Results) -> list[Line]:
    return [line for line in results.lines if line.beside is not None]


def _falls(line: Line) -> Iterator[str]:
    pairs = _beside(line).fell
    difference = MEASURES["fall-difference"].of(line)
    yield f"{pairs.total:,}"
    yield str(pairs.both + pairs.first)
    yield str(pairs.both + pairs.second)
    yield str(pairs.first)
    yield str(pairs.second)
    yield NOTHING if difference is None else MEASURES["fall-difference"].format_interval(difference)
    yield format_p(mcnemar(pairs))


def _ratios(line: Line, names: Sequence[str]) -> Iterator[str]:
    yield f"{_beside(line).upright:,}"
    for name in names:
        measure = MEASURES[name_ratio(name)]
        interval = measure.of(line)
        yield NOTHING if interval is None else measure.format_interval(interval)


def _beside(line: Line) -> Beside:
    if line.beside is None:
        raise ValueError(f"{line.variant} in {line.world} is beside nothing")
    return line.beside


def _build(
    title: str,
    results: Results,
    lines: Sequence[Line],
    columns: Sequence[str],
    cells: Callable[[Line], Iterable[str]],
) -> Table:
    """A row for each world and variant; a swept key has a column with its value."""
    rows = []
    for line in lines:
        pooled = ("all",) * len(results.swept) if line.world == POOLED else ()
        shown = ("refused",) if line.tally.refused else tuple(cells(line))
        fill = (NOTHING,) * (len(columns) - len(shown))
        rows.append((*line.world, *pooled, line.variant, *shown, *fill))
    refused = dict.fromkeys(
        f"{line.variant} was refused: {line.tally.refused}." for line in lines if line.tally.refused
    )
    head = ("scenario", *results.swept, "variant", *columns)
    return Table(title, head, tuple(rows), tuple(refused))
