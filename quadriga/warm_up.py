"""Compile once, before several agents would all compile the same at the same time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from rich.console import Console

from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.jit_cache import compiled_folder, is_switched_off

_DONE: Final = "rehearsed"  # a file beside the machine code of all that an agent runs

_ROBOTS: Final = 2  # the fewest of which one has a peer, whose terms are compiled, too
# Outputs that hardly respond to forces that cost nothing: the best forces are beyond all limits.
_RESPONSE: Final = 1e-5  # of each output to each force, m/s or rad/s per N
_CHEAP: Final = (1e-9, 1e-9, 1e-9)


def warm_up(config: Config, console: Console) -> None:
    """Rehearse an agent once, unless this code has been compiled on this machine before.

    The compiler is imported only then: whoever starts a team need not wait for it.
    """
    folder = compiled_folder()
    if is_switched_off() or _is_compiled(folder):
        return
    with console.status("compiling the agents (the first time only)"):
        _rehearse_agent(config)
    if folder is not None:
        (folder / _DONE).touch()


def load_compiled() -> None:
    """Load what has been compiled, and compile nothing: what this process forks then has it."""
    if not is_switched_off() and _is_compiled(compiled_folder()):
        _rehearse_agent(Config())


def _is_compiled(folder: Path | None) -> bool:
    return folder is not None and (folder / _DONE).exists()


def _rehearse_agent(config: Config) -> None:
    """Everything that an agent with a peer does, limits of its planner's QP included."""
    from quadriga.agents.agent import Agent
    from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
    from quadriga.agents.rehearsal import rehearse
    from quadriga.shared.robot.conventions import N_OUTPUTS

    planner = replace(config.planner, kind="distributed", exchanges=0, R=_CHEAP)
    pair = replace(config, team=replace(config.team, robots=_ROBOTS), planner=planner)
    meta = PredictorMeta.of(pair)
    G = np.full((meta.phases, _ROBOTS, _ROBOTS, N_OUTPUTS * meta.N, meta.width), _RESPONSE)
    rehearse(pair, Agent(pair, "r1", Predictor(meta, G)))
