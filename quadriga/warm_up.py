"""Compile once, before several agents would all compile the same at the same time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console

from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.jit import digest


def warm_up(config: Config, console: Console) -> None:
    """Rehearse an agent once, unless this code has been compiled on this machine before."""
    from quadriga.agents.controller.maths.rotation import roll_pitch_yaw

    # Beside what the compiler keeps: in __pycache__, or the user's cache if the code is read-only.
    stats = getattr(roll_pitch_yaw, "stats", None)
    if stats is None:
        return  # numba's compiler is switched off
    stamp = Path(stats.cache_path) / f"compiled-{digest()}"
    if stamp.exists():
        return
    with console.status("compiling the agents (the first time only)"):
        _rehearse_lone_agent(config)
    stamp.touch()


def _rehearse_lone_agent(config: Config) -> None:
    """Everything that one agent does, with a predictor that predicts nothing."""
    from quadriga.agents.agent import Agent
    from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
    from quadriga.agents.rehearsal import rehearse
    from quadriga.shared.robot.conventions import N_OUTPUTS

    planner = replace(config.planner, kind="distributed", exchanges=0)
    alone = replace(config, team=replace(config.team, robots=1), planner=planner)
    meta = PredictorMeta.of(alone)
    nothing = Predictor(meta, np.zeros((1, 1, 1, N_OUTPUTS * meta.N, meta.width)))
    rehearse(alone, Agent(alone, "r1", nothing))
