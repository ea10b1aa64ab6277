"""Walks with faults, kept as rows of a file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

from rich.console import Console

from quadriga.faults.catalogue import find_fault
from quadriga.faults.fault import REALTIME_ROBOTS, TeamFault
from quadriga.faults.trial import run_fault_trial
from quadriga.identification.predictors import ensure_predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, ProcessError
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.printable import printable_line
from quadriga.shared.runtime.clock import monotonic
from quadriga.team.trial_rows import append_row, open_rows
from quadriga.warm_up import warm_up
from quadriga.workers import run_each

_TIMES: Final = (
    ("detect_ms", "noticed after"),
    ("stand_ms", "others stood after"),
    ("recover_ms", "all walked again after"),
)


class _Try(NamedTuple):
    """One walk; a worker process finds the fault by its name."""

    config: Config
    fault: str
    seed: int
    folder: Path
    predictor: Path | None


def run_fault_campaign(
    config: Config,
    faults: Sequence[TeamFault],
    seeds: Sequence[int],
    folder: Path,
    console: Console,
    jobs: int = 1,
) -> list[dict[str, Any]]:
    """Every fault with every seed; what is in the folder already is not walked again.

    Args:
        config: of a simulated world.
        faults: what goes wrong.
        seeds: of the worlds.
        folder: gets a folder for each walk, and the file of rows.
        console: told of each walk.
        jobs: teams that walk side by side in lock-step; in real time each walks alone.

    Returns:
        All rows of the folder.

    Raises:
        ConfigError: the plant is not one simulated world, the folder cannot be written to, or it
            holds walks of another configuration.
        ProcessError: a worker process died.
    """
    if not config.team.one_world:
        raise ConfigError("team.plant", repr(config.team.plant), "one simulated world")
    rows = open_rows(config, folder)
    known = {(row["fault"], row["seed"]) for row in rows}
    todo = [(f, seed) for seed in seeds for f in faults if (f.name, seed) not in known]
    side, alone, predictors = list[_Try](), list[_Try](), dict[int, Path | None]()
    for fault, seed in todo:
        own = config_for(config, fault)
        if own.team.robots not in predictors:
            predictors[own.team.robots] = _predictor_of(own, console)
        name = re.sub(r"[^\w.-]+", "-", f"{fault.name}-{seed}")
        item = _Try(own, fault.name, seed, folder / name, predictors[own.team.robots])
        (alone if fault.realtime or jobs == 1 else side).append(item)
    results = chain(run_each(_walk, side, jobs) if side else (), ((t, _walk(t)) for t in alone))
    begun = monotonic()
    for number, (done, row) in enumerate(results, start=1):
        rows.append(row)
        append_row(row, folder)
        name = f"{done.fault}-{done.seed} ({monotonic() - begun:.1f} s)"
        line = f"{number}/{len(todo)} {name}: {describe_row(row)}"
        console.print(printable_line(line), markup=False, highlight=False, soft_wrap=True)
        begun = monotonic()
    return rows


def config_for(config: Config, fault: TeamFault) -> Config:
    """The team that is walked with a fault: in real time of few robots."""
    most = REALTIME_ROBOTS if fault.realtime else config.team.robots
    return replace(config, team=replace(config.team, robots=min(config.team.robots, most)))


def _predictor_of(config: Config, console: Console) -> Path | None:
    """The predictor that a team walks with, made now if it has not been; None: it needs none."""
    warm_up(config, console)
    return (
        ensure_predictor(config, console)
        if find_kind(config.planner.kind).needs_predictor
        else None
    )


def _walk(item: _Try) -> dict[str, Any]:
    fault = find_fault(item.fault, item.config)
    try:
        return run_fault_trial(item.config, fault, item.seed, item.folder, item.predictor)
    except ProcessError as error:
        # Rows are published, and where they were walked is nobody's business.
        text = str(error).replace(f"{item.folder}/", "")
        return {"fault": item.fault, "seed": item.seed, "error": text}


def describe_row(row: dict[str, Any]) -> str:
    """A walk in one line."""
    if "error" in row:
        return f"no result: {row['error'].splitlines()[0]}"
    parts = [f"at {row['robot']}, {1e-3 * row['tick']:.2f} s"]
    parts.append(f"fell: {', '.join(row['falls']) or 'none'}")
    if row["lost"]:
        parts.append(f"without commands: {', '.join(row['lost'])}")
    for name, title in _TIMES:
        if row[name]:
            parts.append(f"{title} {row[name]} ms")
    parts += [f"{name}: {what}" for name, what in row["status"].items() if what != "walk"]
    return "; ".join(parts)
