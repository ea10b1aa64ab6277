"""Walks in real time: how many commands come late, how old the oldest is, whether anybody falls."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from quadriga.recordings.summary import summarise
from quadriga.shared.config.sections import Config
from quadriga.shared.config.write import to_toml
from quadriga.shared.robots.conventions import robot_names
from quadriga.team.endpoint import free_endpoint
from quadriga.team.launch import Launch, process_table
from quadriga.team.run_folder import CONFIG


def measure(
    config: Config,
    file: Path | None,
    sha256: str,
    seeds: Sequence[int],
    tell: Callable[[str], None],
) -> dict[str, Any]:
    """Walk once for each seed; the share of late commands is the median over the walks.

    Args:
        config: the team's configuration, in real time.
        file: of the predictor; None without a planner.
        sha256: of the predictor.
        seeds: of the worlds.
        tell: called with the progress.

    Raises:
        ProcessError: a process failed or left too early.
    """
    rows = []
    for seed in seeds:
        tell(f"seed {seed}")
        seeded = replace(config, world=replace(config.world, seed=seed))
        rows.append({"seed": seed, **_walk(seeded, file, sha256)})
    shares = [row["late_share"] for row in rows]
    return {"robots": config.team.robots, "rows": rows, "late_share": median(shares)}


def _walk(config: Config, file: Path | None, sha256: str) -> dict[str, Any]:
    ready = replace(config, bus=replace(config.bus, endpoint=free_endpoint()))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        (folder / CONFIG).write_text(to_toml(ready), encoding="utf-8")
        with Launch(process_table(ready, folder, file, sha256), folder / "logs") as launch:
            launch.watch(lambda: False)
        return late_commands(summarise(folder), config)


def late_commands(summary: dict[str, Any], config: Config) -> dict[str, Any]:
    """What came late in a walk, of the robot that did worst; all of one that no tick was due from.

    Args:
        summary: of the walk.
        config: of its team.
    """
    robots = [summary["realtime"][name] for name in robot_names(config.team.robots)]
    return {
        "rtf": summary["real_time_factor"],
        "late_share": max(_share(robot) for robot in robots),
        "oldest_ms": max(robot["command_age_ms"].get("max", 0.0) for robot in robots),
        "gaps": summary["gaps"],
        "fallen": list(summary["fallen"]),
        "end": summary["end"],
    }


def _share(robot: dict[str, Any]) -> float:
    share = robot["late_share"]
    return 1.0 if share is None else float(share)
