"""Measures the responses of a team once, and keeps them in the user's cache."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

from rich.console import Console

from quadriga.experiments.probe.measure import join_robots, measure_robot
from quadriga.experiments.probe.responses import (
    Repetition,
    Responses,
    average,
    read_repetition,
    write_repetition,
)
from quadriga.identification.behaviour import behaviour
from quadriga.progress import build_progress
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.runtime.places import cache_file
from quadriga.workers import run_each

# What a measured walk rests on besides this project's code.
_LIBRARIES: Final = ("mujoco", "pin", "numpy", "numba", "daqp", "example-robot-data")
# What responses do not depend on. Of the planner they depend on three keys alone.
_OTHER_SECTIONS: Final = ("bridge", "bus", "identification", "plant", "recorder", "runtime")
_OTHER_KEYS: Final = {"team": ("name", "plant", "plant_per_robot"), "world": ("scenario", "mode")}
_OF_PLANNER: Final = ("interface", "N", "applied")


def response_key(config: Config) -> str:
    """Key of the responses in the world of `config`: all that they depend on."""
    sections: dict[str, Any] = {
        section: {k: v for k, v in keys.items() if k not in _OTHER_KEYS.get(section, ())}
        for section, keys in asdict(config).items()
        if section not in _OTHER_SECTIONS
    }
    sections["planner"] = {k: sections["planner"][k] for k in _OF_PLANNER}
    code = behaviour("quadriga.experiments.probe.sample_responses")
    libraries = {name: version(name) for name in _LIBRARIES}
    parts = [sections, code, libraries]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def response_path(config: Config) -> Path:
    """Where the responses in the world of `config` are kept."""
    return cache_file("responses", response_key(config))


def ensure_responses(configs: Sequence[Config], jobs: int, console: Console) -> Responses:
    """The mean responses over these worlds, from the cache or measured now.

    Args:
        configs: the same team and terrain with different `world.seed`.
        jobs: processes to use.
        console: for the progress bar.

    Raises:
        PredictorError: robots fall, so that a pulse was measured in no world.
        ProcessError: a worker died.
    """
    repetitions = {}
    for config in configs:
        path = response_path(config)
        if path.is_file():
            repetitions[config.world.seed] = read_repetition(path)
    missing = [config for config in configs if config.world.seed not in repetitions]
    if missing:
        repetitions |= _measure(missing, jobs, console)
    mean = average([repetitions[config.world.seed] for config in configs])
    if mean is None:
        raise PredictorError(
            "responses to pulses",
            "falls in every walk of a pulse",
            "a walk on which the low level alone does not fall",
            "another scenario or speed, or more repetitions",
        )
    return mean


def _measure(configs: Sequence[Config], jobs: int, console: Console) -> dict[int, Repetition]:
    """Measure and keep the responses in each world; by its seed."""
    n, first = configs[0].team.robots, configs[0]
    worlds = {config.world.seed: config for config in configs}
    plan = [(seed, robot) for seed in worlds for robot in range(n)]
    parts: dict[tuple[int, int], Repetition] = {}
    done: dict[int, Repetition] = {}
    label = f"measuring the responses of {n} robots in {len(worlds)} worlds"
    with build_progress(
        console, "{task.completed}/{task.total} walks", elapsed=True, hidden=False
    ) as progress:
        task = progress.add_task(label, total=len(plan))
        with closing(run_each(partial(_measure_planned, first), plan, jobs)) as results:
            for (seed, robot), part in results:
                parts[seed, robot] = part
                progress.advance(task)
                of_seed = [parts[seed, k] for k in range(n) if (seed, k) in parts]
                if len(of_seed) == n:
                    done[seed] = join_robots(of_seed)
                    write_repetition(response_path(worlds[seed]), done[seed])
    return done


def _measure_planned(config: Config, planned: tuple[int, int]) -> Repetition:
    return measure_robot(config, *planned)
