"""Columns of the table of what became of each variant's walks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from quadriga.experiments.campaign.analysis import Tally
from quadriga.experiments.campaign.sheets import unbroken
from quadriga.experiments.published.results import Line
from quadriga.recordings.traces import ERRORS
from quadriga.tables import format_number, format_output, label_output

Column = tuple[str, Callable[[Line], str]]  # its heading, and a line's cell


def _success(line: Line) -> str:
    low, high = line.tally.success
    share = 100 * line.tally.successes / line.tally.trials
    return unbroken(f"{share:.1f} [{100 * low:.1f}, {100 * high:.1f}]")


def _of(read: Callable[[Tally], float | None], digits: str) -> Callable[[Line], str]:
    return lambda line: format_number(read(line.tally), digits)


def _rmse(name: str) -> Callable[[Line], str]:
    return lambda line: format_output(name, line.tally.rmse[name])


COLUMNS: Final[Mapping[str, Column]] = {
    "trials": ("trials", lambda line: f"{line.tally.trials:,}"),
    "success": ("success [%]", _success),
    "falls": ("falls", lambda line: str(line.tally.falls)),
    "stops": ("stops", lambda line: str(line.tally.stops)),
    "time-to-fall": ("time to fall [s]", _of(lambda found: found.time_to_fall, ".2f")),
    "vx": ("mean vx [m/s]", _of(lambda found: found.mean_vx, ".3f")),
    "transport": ("cost of transport", _of(lambda found: found.cost_of_transport, ".2f")),
    "cost": ("control cost", _of(lambda found: found.control_cost, ".0f")),
    "p50": ("plan p50 [ms]", _of(lambda found: found.planner_ms_p50, ".2f")),
    "p99": ("p99 [ms]", _of(lambda found: found.planner_ms_p99, ".2f")),
    **{f"rmse-{name}": (f"RMSE {label_output(name)}", _rmse(name)) for name in ERRORS},
}
