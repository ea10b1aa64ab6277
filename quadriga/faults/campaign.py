"""Walks with faults, one after another, kept as rows of a file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.faults.fault import TeamFault
from quadriga.faults.trial import run_fault_trial
from quadriga.identification.predictors import ensure_predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, ProcessError
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.printable import printable_line
from quadriga.team.trial_rows import append_row, open_rows
from quadriga.warm_up import warm_up

REALTIME_ROBOTS: Final = 2  # at most: a computer of two cores keeps up with no more


def run_fault_campaign(
    config: Config,
    faults: Sequence[TeamFault],
    seeds: Sequence[int],
    folder: Path,
    console: Console,
) -> list[dict[str, Any]]:
    """Every fault with every seed; what is in the folder already is not walked again.

    Args:
        config: of a simulated world.
        faults: what goes wrong.
        seeds: of the worlds.
        folder: gets a folder for each walk, and the file of rows.
        console: told of each walk.

    Returns:
        All rows of the folder.

    Raises:
        ConfigError: the plant is not one simulated world, the folder cannot be written to, or it
            holds walks of another configuration.
    """
    if not config.team.one_world:
        cause = "robots behind bridges: `quadriga desk`"
        raise ConfigError("team.plant", repr(config.team.plant), "one simulated world", cause)
    rows = open_rows(config, folder)
    known = {(row["fault"], row["seed"]) for row in rows}
    todo = [(f, seed) for seed in seeds for f in faults if (f.name, seed) not in known]
    for number, (fault, seed) in enumerate(todo, start=1):
        name = f"{fault.name}-{seed}"
        row = _walk(config_for(config, fault), fault, seed, folder / name, console)
        rows.append(row)
        append_row(row, folder)
        line = f"{number}/{len(todo)} {name}: {describe_row(row)}"
        console.print(printable_line(line), markup=False, highlight=False, soft_wrap=True)
    return rows


def config_for(config: Config, fault: TeamFault) -> Config:
    """The team that is walked with a fault: in real time of few robots."""
    most = REALTIME_ROBOTS if fault.realtime else config.team.robots
    return replace(config, team=replace(config.team, robots=min(config.team.robots, most)))


def _walk(
    config: Config, fault: TeamFault, seed: int, folder: Path, console: Console
) -> dict[str, Any]:
    warm_up(config, console)
    predictor = None
    if find_kind(config.planner.kind).needs_predictor:
        predictor = ensure_predictor(config, console)
    try:
        return run_fault_trial(config, fault, seed, folder, predictor)
    except ProcessError as error:
        # Rows are published, and where they were walked is nobody's business.
        text = str(error).replace(f"{folder}/", "")
        return {"fault": fault.name, "seed": seed, "error": text}


def describe_row(row: dict[str, Any]) -> str:
    """A walk in one line."""
    if "error" in row:
        return f"no result: {row['error'].splitlines()[0]}"
    parts = [f"at {row['robot']}, {1e-3 * row['tick']:.2f} s"]
    parts.append(f"fell: {', '.join(row['falls']) or 'none'}")
    if row["lowered"]:
        parts.append(f"led down: {', '.join(row['lowered'])}")
    for name, title in (("detect_ms", "noticed after"), ("stand_ms", "others stood after")):
        if row[name] is not None:
            parts.append(f"{title} {row[name]} ms")
    if "forged" in row:
        parts.append(f"refused {row['refused']} of {row['forged']}")
    parts += [f"{name}: {what}" for name, what in row["status"].items() if what != "walk"]
    return "; ".join(parts)
