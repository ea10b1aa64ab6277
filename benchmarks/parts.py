"""The parts of the benchmark, one function each, which imports what it needs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

if TYPE_CHECKING:
    from quadriga.agents.predictor.predictor import Predictor
    from quadriga.shared.config.sections import Config

Tell = Callable[[str], None]
Part = dict[str, Any]


@dataclass(frozen=True)
class Options:
    """Which parts, how large and how long.

    Attributes:
        parts: names of the parts, in order.
        robots: sizes of the teams that walk.
        seconds: world time of each walk.
        seed: of the worlds in which plans are made.
        planner: `planner.kind` of the walks.
        quick: whether every part is as small as possible.
        out: the JSON file.
    """

    parts: tuple[str, ...]
    robots: tuple[int, ...]
    seconds: float
    seed: int
    planner: str
    quick: bool
    out: Path

    @property
    def middle(self) -> int:
        """The size of the team in the parts that measure one: 3 unless only others walk."""
        return min(self.robots, key=lambda n: abs(n - 3))


def planner(options: Options, console: Console, tell: Tell) -> Part:
    """Time of a plan, ours and as written."""
    from benchmarks.planner import measure, record_walks

    robots, seconds = (1, 1.0) if options.quick else (options.middle, options.seconds)
    config, predictor, walks = record_walks(robots, seconds, console, options.seed)
    tell("plans")
    return {"rows": measure(config, predictor, walks)}


def low_level(options: Options, console: Console, tell: Tell) -> Part:
    """The tick of one robot's low level."""
    from benchmarks import low_level, low_level_ticks
    from benchmarks.children import result_of

    seconds, passes = (0.5, 1) if options.quick else (2.5, 3)
    config, _, predictor = team(options, options.middle, seconds, console)
    ticks = low_level_ticks.record(config, predictor)
    tell("ticks")
    return dict(result_of(low_level.measure, config, predictor, ticks, passes))


def bus(options: Options, _console: Console, tell: Tell) -> Part:
    """The messages of a tick, over the bus and over sockets."""
    from benchmarks.messaging import measure

    rows = []
    for robots in (2,) if options.quick else (1, 3, 5):
        tell(f"n = {robots}")
        rows.append(measure(robots, 250 if options.quick else 4000))
    return {"rows": rows}


def recorder(options: Options, _console: Console, _tell: Tell) -> Part:
    """The recorder's throughput."""
    from benchmarks.recorder import measure

    with tempfile.TemporaryDirectory() as scratch:
        rate, seconds = (2000.0, 0.5) if options.quick else (20_000.0, 5.0)
        return dict(measure(rate, seconds, 2, Path(scratch)))


def fit(options: Options, _console: Console, tell: Tell) -> Part:
    """The predictor's fit, for each size of a team that has a limit."""
    from benchmarks.children import result_of
    from benchmarks.fit import SIZES, measure

    rows = []
    for size in SIZES[:1] if options.quick else SIZES:
        tell(f"n = {size.robots}")
        found = result_of(measure, size.robots, 2100 if options.quick else size.samples)
        kept = found["seconds"] <= size.seconds and found["peak_gb"] <= size.gigabytes
        rows.append({**found, "most_seconds": size.seconds, "kept": kept})
    return {"rows": rows}


def walks(options: Options, console: Console, tell: Tell) -> Part:
    """Real walks of every team size."""
    from benchmarks.children import result_of
    from benchmarks.walks import alone, over_the_bus
    from quadriga.warm_up import warm_up

    rows = []
    for robots in options.robots:
        config, path, predictor = team(options, robots, options.seconds, console)
        warm_up(config, console)
        tell(f"n = {robots} in one process")
        parts = result_of(alone, config, predictor)
        figures = over_the_bus(config, path, predictor, add_prefix(tell, f"n = {robots}"))
        rows.append({"robots": robots, "alone": parts, **figures})
    return {"rows": rows, "planner": options.planner, "seconds": options.seconds}


def add_prefix(tell: Tell, prefix: str) -> Tell:
    """A function that calls `tell` with `prefix` before the text."""
    return lambda text: tell(f"{prefix}: {text}")


def team(
    options: Options, robots: int, seconds: float, console: Console
) -> tuple[Config, Path | None, Predictor | None]:
    """A team that walks on flat ground, its predictor's file and the predictor."""
    from quadriga.agents.predictor.gates import load_checked
    from quadriga.identification.predictors import ensure_predictor
    from quadriga.shared.config.load import load
    from quadriga.shared.planner_kinds import find_kind

    config = load(
        None, {"team.robots": robots, "world.duration": seconds, "planner.kind": options.planner}
    )
    if not find_kind(options.planner).needs_predictor:
        return config, None, None
    path = ensure_predictor(config, console)
    return config, path, load_checked(path, config)[0]


PARTS: dict[str, Callable[[Options, Console, Tell], Part]] = {
    "planner": planner, "low-level": low_level, "bus": bus,
    "recorder": recorder, "fit": fit, "walks": walks,
}  # fmt: skip
