"""What came of an experiment, small enough to be kept beside the page that shows it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from quadriga.experiments.campaign.analysis import COST, Tally
from quadriga.experiments.campaign.statistics import Pairs
from quadriga.recordings.traces import ERRORS
from quadriga.shared.errors import ConfigError

FORMAT: Final = 1


@dataclass(frozen=True, slots=True)
class Ratio:
    """Paired ratios: how many, their median, and the ends of its interval if there are enough."""

    pairs: int
    median: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class Beside:
    """A variant beside the baseline, in the same worlds.

    Attributes:
        fell: pairs by who fell; the first is the variant.
        upright: pairs in which both walked to the end.
        ratios: of control cost and of the RMSE of each of `ERRORS`, variant over baseline, of
            these pairs.
    """

    fell: Pairs
    upright: int
    ratios: Mapping[str, Ratio]


@dataclass(frozen=True, slots=True)
class Line:
    """What came of a variant in a world, or in all of them together.

    Attributes:
        scenario: or `ALL`.
        swept: the swept value as text, if any.
        variant: its name.
        wanted: trials there should be.
        done: trials there are, refused ones included.
        wall_s: what they took, s of one core.
        tally: what came of them.
        beside: against the baseline; None for that itself, or without any pair.
    """

    scenario: str
    swept: str
    variant: str
    wanted: int
    done: int
    wall_s: float
    tally: Tally
    beside: Beside | None

    @property
    def world(self) -> tuple[str, ...]:
        """Scenario and, if any, swept value."""
        return (self.scenario, self.swept) if self.swept else (self.scenario,)


@dataclass(frozen=True, slots=True)
class Results:
    """Everything that is published of an experiment.

    Attributes:
        versions: of code and libraries.
        baseline: the variant that others are compared with.
        variants: keys of each variant, by name.
        seeds: those of the trials there are, as text.
        lines: of every world and variant that has a trial, then of all worlds together.
    """

    versions: tuple[str, ...] = ()
    baseline: str = ""
    variants: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seeds: str = ""
    lines: tuple[Line, ...] = ()

    def find(self, world: tuple[str, ...], variant: str) -> Line | None:
        """The line of a variant in a world."""
        return next(
            (line for line in self.lines if line.world == world and line.variant == variant), None
        )


def to_json(results: Results) -> str:
    """As text, numbers to six digits; a line for each world and variant, so that changes show."""
    body = _rounded({"format": FORMAT, **asdict(results)})
    lines = ",\n".join(f"  {json.dumps(line, ensure_ascii=False)}" for line in body.pop("lines"))
    head = "".join(
        f' "{name}": {json.dumps(value, ensure_ascii=False)},\n' for name, value in body.items()
    )
    return f'{{\n{head} "lines": [\n{lines}\n ]\n}}\n'


def from_json(text: str, name: str) -> Results:
    """The inverse of `to_json`, but for what rounding took.

    Args:
        text: of a file.
        name: of that file.

    Raises:
        ConfigError: it is something else.
    """
    try:
        body = json.loads(text)
        if body.pop("format") != FORMAT:
            raise ValueError("another format")
        lines = tuple(map(_line, body.pop("lines")))
        versions = tuple(body.pop("versions"))
        return Results(versions=versions, lines=lines, **body)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise ConfigError(
            name,
            str(error) or type(error).__name__,
            "what `quadriga experiments` wrote there",
            "edited by hand?",
        ) from None


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, Mapping):
        return {key: _rounded(one) for key, one in value.items()}
    return [_rounded(one) for one in value] if isinstance(value, (list, tuple)) else value


def _line(body: Mapping[str, Any]) -> Line:
    beside = body["beside"]
    if beside is not None:
        ratios = {name: Ratio(**beside["ratios"][name]) for name in (COST, *ERRORS)}
        beside = Beside(Pairs(**beside["fell"]), beside["upright"], ratios)
    tally = Tally(**body["tally"])
    if set(tally.rmse) != set(ERRORS):
        raise ValueError(f"errors {', '.join(tally.rmse)}")
    return Line(**{**body, "tally": tally, "beside": beside})
