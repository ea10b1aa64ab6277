"""What can be measured of a variant in a world, each with its 95 % interval where it has one."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from quadriga.experiments.results import COST, Line, Tally
from quadriga.experiments.statistics import mcnemar, paired_difference, wilson
from quadriga.recordings.traces import ERRORS
from quadriga.tables import UNITS, error_text


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure with the ends of its 95 % interval; None where it has none."""

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of a variant.

    Attributes:
        text: what it is; `{}` stands for the baseline.
        unit: of the figure and of what it must come to; empty for a bare number.
        digits: how it is written.
        of: the figure, None if the trials do not give it.
        paired: whether it is of pairs with the baseline.
        interval: whether it has one.
    """

    text: str
    unit: str
    digits: str
    of: Callable[[Line], Interval | None]
    paired: bool = False
    interval: bool = True

    def format_value(self, value: float, *, signed: bool = True) -> str:
        """A value of it as text, without its unit."""
        if self.digits == "p":
            return format_p(value)
        if math.isinf(value):
            return "∞"
        return format(value, self.digits if signed else self.digits.removeprefix("+"))

    def format_interval(self, interval: Interval) -> str:
        """Value and interval as text that no line ends in."""
        text = self.format_value(interval.value)
        if interval.low is not None and interval.high is not None:
            text += f" [{self.format_value(interval.low)}, {self.format_value(interval.high)}]"
        return keep_together(text)


def format_p(p: float) -> str:
    """A p value with two digits that say something."""
    return "< 0.0001" if p < 1e-4 else f"{p:.2g}"


def keep_together(text: str) -> str:
    """The text with spaces that no line ends at."""
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def name_ratio(error: str) -> str:
    """The measure of the paired ratio of the control cost or of one of `ERRORS`."""
    return f"ratio-{error}"


def _share(count: Callable[[Tally], int]) -> Callable[[Line], Interval | None]:
    def of(line: Line) -> Interval | None:
        found, total = count(line.tally), line.tally.trials
        if not total:
            return None
        low, high = wilson(found, total)
        return Interval(100 * found / total, 100 * low, 100 * high)

    return of


def _falls(line: Line) -> Interval | None:
    return Interval(float(line.tally.falls)) if line.tally.trials else None


def _difference(line: Line) -> Interval | None:
    if line.beside is None or not line.beside.fell.total:
        return None
    value, low, high = paired_difference(line.beside.fell)
    return Interval(100 * value, 100 * low, 100 * high)


def _fall_ratio(line: Line) -> Interval | None:
    """Falls over those of the baseline; none if neither ever fell, which tells nothing."""
    if line.beside is None:
        return None
    pairs = line.beside.fell
    mine, theirs = pairs.both + pairs.first, pairs.both + pairs.second
    if not theirs:
        return Interval(math.inf) if mine else None
    return Interval(mine / theirs)


def _fewer(line: Line) -> Interval | None:
    """McNemar's p, and 1 where the variant falls more: then nothing speaks for it."""
    if line.beside is None or not line.beside.fell.total:
        return None
    pairs = line.beside.fell
    return Interval(mcnemar(pairs) if pairs.first <= pairs.second else 1.0)


def _ratio(name: str) -> Callable[[Line], Interval | None]:
    def of(line: Line) -> Interval | None:
        ratio = None if line.beside is None else line.beside.ratios.get(name)
        if ratio is None or ratio.median is None:
            return None
        return Interval(ratio.median, ratio.low, ratio.high)

    return of


def _read(
    read: Callable[[Tally], float | None], factor: float = 1.0
) -> Callable[[Line], Interval | None]:
    def of(line: Line) -> Interval | None:
        figure = read(line.tally)
        return None if figure is None else Interval(factor * figure)

    return of


def _greatest(name: str) -> Measure:
    unit, factor = UNITS[name]
    of = _read(lambda tally: tally.rmse_max[name], factor)
    return Measure(
        f"greatest RMSE of {error_text(name)} of a walk", unit, ".1f", of, interval=False
    )


MEASURES: Final[Mapping[str, Measure]] = {
    "success": Measure("success", "%", ".1f", _share(lambda tally: tally.successes)),
    "falls": Measure("number of falls", "", ".0f", _falls, interval=False),
    "fall-rate": Measure("share of walks with a fall", "%", ".1f",
                         _share(lambda tally: tally.falls)),
    "fall-difference": Measure("fall rate less that of {}", "points", "+.1f", _difference,
                               paired=True),
    "fall-ratio": Measure("falls over those of {}", "", ".2f", _fall_ratio, paired=True,
                          interval=False),
    "fewer-falls": Measure("McNemar's p of falling less than {}", "", "p", _fewer, paired=True,
                           interval=False),
    **{
        name_ratio(name): Measure(
            "control cost over that of {}, median" if name == COST
            else f"RMSE of {error_text(name)} over that of {{}}, median",
            "", ".3f", _ratio(name), paired=True,
        )
        for name in (COST, *ERRORS)
    },
    "slowest": Measure("least mean vx of a walk", "m/s", ".3f",
                       _read(lambda tally: tally.slowest), interval=False),
    "fastest": Measure("greatest mean vx of a walk", "m/s", ".3f",
                       _read(lambda tally: tally.fastest), interval=False),
    **{f"max-{name}": _greatest(name) for name in ERRORS},
    "p99": Measure("99th percentile of a planning step", "ms", ".2f",
                   _read(lambda tally: tally.planner_ms_p99), interval=False),
}  # fmt: skip
