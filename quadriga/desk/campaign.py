"""Walks on the desk, one after another, kept as rows of a file and summed up in a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console

from quadriga.desk.faults import BY_NAME, NO_FAULT, Fault
from quadriga.desk.tables import is_too_slow
from quadriga.desk.trial import WITHOUT, run_trial, walk_without_bridges
from quadriga.identification.predictors import ensure_predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError, ProcessError, did_you_mean
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.printable import printable_line
from quadriga.team.trial_rows import append_row, open_rows
from quadriga.warm_up import warm_up

ALL: Final = "all"


def named_faults(names: Sequence[str]) -> list[Fault]:
    """Faults by their names, in the order of the table; without a name the walk alone.

    Raises:
        ConfigError: there is no such fault.
    """
    if not names:
        return [NO_FAULT]
    for name in names:
        if name not in (ALL, NO_FAULT.name, *BY_NAME):
            hint = did_you_mean(name, BY_NAME)
            raise ConfigError("--fault", repr(name), f"all, none, {', '.join(BY_NAME)}", hint)
    chosen = [fault for name, fault in BY_NAME.items() if name in names or ALL in names]
    return ([NO_FAULT] if NO_FAULT.name in names else []) + chosen


def run_campaign(
    config: Config,
    faults: Sequence[Fault],
    seeds: Sequence[int],
    folder: Path,
    console: Console,
    *,
    compare: bool,
) -> list[dict[str, Any]]:
    """Every fault with every seed; what is in the folder already is not walked again.

    Args:
        config: of bridged robots on this machine.
        faults: what goes wrong.
        seeds: of the worlds.
        folder: gets a folder for each walk, and `rows.jsonl`.
        console: told of each walk.
        compare: whether each seed also walks without bridges.

    Raises:
        ConfigError: the folder cannot be written to, or holds walks of another configuration.
    """
    rows = open_rows(config, folder)
    known = {(row["fault"], row["seed"]) for row in rows}
    warm_up(config, console)
    if find_kind(config.planner.kind).needs_predictor:
        ensure_predictor(config, console)
    todo = [t for t in _trials(faults, seeds, compare=compare) if t[:2] not in known]
    for number, (name, seed, fault) in enumerate(todo, start=1):
        row = _walk(config, name, seed, fault, folder / f"{name}-{seed}")
        rows.append(row)
        append_row(row, folder)
        line = f"{number}/{len(todo)} {name} {seed}: {describe_row(row)}"
        console.print(printable_line(line), markup=False)
    return rows


def _trials(
    faults: Sequence[Fault], seeds: Sequence[int], *, compare: bool
) -> Iterator[tuple[str, int, Fault | None]]:
    for fault in faults:
        for seed in seeds:
            yield fault.name, seed, fault
    for seed in seeds if compare else ():
        yield WITHOUT, seed, None


def _walk(
    config: Config, name: str, seed: int, fault: Fault | None, folder: Path
) -> dict[str, Any]:
    try:
        if fault is None:
            return walk_without_bridges(config, seed, folder)
        return run_trial(config, fault, seed, folder)
    except ProcessError as error:
        # Rows are published, and where they were walked is nobody's business.
        return {"fault": name, "seed": seed, "error": str(error).replace(f"{folder}/", "")}


def has_failed(row: dict[str, Any]) -> bool:
    """Whether there was no walk, or a robot fell that nothing was done to."""
    return "error" in row or bool(set(row["fell"]) - {row.get("robot")})


def describe_row(row: dict[str, Any]) -> str:
    """A walk in one line."""
    if "error" in row:
        return f"no walk: {row['error'].splitlines()[0]}"
    parts = [f"fell: {', '.join(row['fell']) or 'none'}"]
    if is_too_slow(row):
        parts.insert(0, f"this computer kept {100 * row['kept']:.0f} % of real time")
    if row.get("figures"):
        speed = np.mean([figures.get("vx", np.nan) for figures in row["figures"].values()])
        parts.append(f"{speed:.2f} m/s")
    if row.get("robot"):
        parts.append(f"fault of {row['robot']}")
    if row.get("rest_ms"):
        rest = ", ".join(f"{name} {ms}" for name, ms in row["rest_ms"].items())
        parts.append(f"ms to rest: {rest}")
    for who in ("status", "agents"):
        parts += [f"{who} {name}: {what}" for name, what in row.get(who, {}).items() if what]
    return "; ".join(parts)
