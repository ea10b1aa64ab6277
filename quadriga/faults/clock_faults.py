"""Faults of clocks: that of one process jumps, or runs fast or slow."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from quadriga.faults import skewed
from quadriga.faults.fault import OWN, Draw, FaultScene, SetStage, Stage, TeamFault, robot_of
from quadriga.shared.config.sections import Config
from quadriga.shared.members import OPERATOR, RECORDER, SIM
from quadriga.shared.runtime.installed import PYTHON
from quadriga.team.launch import QUADRIGA, ProcessSpec

_STEPS_S: Final = (-3600.0, -1.0, 1.0, 3600.0)
_DRIFT: Final = 500e-6  # more than any two computers' clocks run apart
_SOUND: Final = "0 0"
_STREAM: Final = 2  # of the seed; when and whom a fault meets is drawn from another one

_Skew: TypeAlias = tuple[float, float]
"""By how much the wall clock is ahead, s, and by what share both clocks run fast."""


def _draw_step(chance: np.random.Generator) -> _Skew:
    return float(chance.choice(_STEPS_S)), 0.0


def _draw_drift(chance: np.random.Generator) -> _Skew:
    return 0.0, float(chance.choice((-_DRIFT, _DRIFT)))


def _skewed(draw_skew: Callable[[np.random.Generator], _Skew], whose: tuple[str, ...]) -> SetStage:
    """The clock of a chosen robot's agent, or of one of `whose` that is drawn, goes wrong."""

    @contextmanager
    def stage(config: Config, draw: Draw, folder: Path) -> Iterator[Stage]:
        chance = np.random.default_rng((draw.seed, _STREAM))
        named, (step_s, rate) = str(chance.choice(whose)), draw_skew(chance)
        named = OWN if draw.chosen else named
        name, file = draw.robot if named == OWN else named, folder / "clock"
        file.write_text(_SOUND, encoding="ascii")

        def wrap(row: ProcessSpec) -> ProcessSpec:
            if row.name != name:
                return row
            words = (*PYTHON, "-m", skewed.__name__, str(file))
            return replace(row, command=(*words, *row.command[len(QUADRIGA) - 1 :]))

        def strike(scene: FaultScene) -> None:
            file.write_text(f"{step_s} {rate}", encoding="ascii")
            os.kill(scene.launch.pids[name], signal.SIGUSR1)
            scene.facts |= {"process": name, "step_s": step_s, "drift": rate}

        by = f"{step_s:+g} s" if step_s else f"{1e6 * rate:+g} ppm"
        yield Stage(config, strike, wrap, robot_of(named, draw), f"of {name}, by {by}")

    return stage


CLOCK_FAULTS: Final = (
    TeamFault(
        "clock-step",
        "the wall clock of one process jumps by a second or an hour, forth or back",
        _skewed(_draw_step, (OWN, OPERATOR, RECORDER, SIM)),
    ),
    TeamFault(
        "clock-drift",
        f"the clocks of one process run {1e6 * _DRIFT:g} ppm fast or slow from then on",
        _skewed(_draw_drift, (OWN, OPERATOR, SIM)),
    ),
)
"""In the order of the table."""
