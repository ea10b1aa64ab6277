"""Compile once, before several agents would all compile the same at the same time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from rich.console import Console

from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.jit_cache import REHEARSED, compiled_folder, is_switched_off

_ROBOTS: Final = 2  # the fewest of which one has a peer, whose terms are compiled, too
_UNKEPT: Final = (
    "the agents are compiled anew, for a minute or two: no folder for machine code can be written "
    "to, or its disk is full; set NUMBA_CACHE_DIR or XDG_CACHE_HOME to one with room"
)


def warm_up(config: Config, console: Console) -> None:
    """Rehearse an agent once, unless this code has been compiled on this machine before.

    The compiler is imported only then: whoever starts a team need not wait for it.
    """
    folder = compiled_folder()
    if is_switched_off() or _is_compiled(folder):
        return
    if folder is None:  # who forks the agents compiles
        console.print(_UNKEPT)
        return
    with console.status("compiling the agents (the first time only)"):
        _rehearse_agent(config)
    (folder / REHEARSED).touch()


def load_compiled() -> None:
    """Load what has been compiled: what this process forks then has it.

    Where nothing can be kept it is compiled here, once for all forks.
    """
    folder = compiled_folder()
    if not is_switched_off() and (folder is None or _is_compiled(folder)):
        _rehearse_agent(Config())


def _is_compiled(folder: Path | None) -> bool:
    return folder is not None and (folder / REHEARSED).exists()


def _rehearse_agent(config: Config) -> None:
    """Everything that an agent with a peer does, with a predictor that predicts nothing."""
    from quadriga.agents.agent import Agent
    from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
    from quadriga.agents.rehearsal import rehearse
    from quadriga.shared.robots.conventions import N_OUTPUTS

    planner = replace(config.planner, kind="distributed", exchanges=0)
    pair = replace(config, team=replace(config.team, robots=_ROBOTS), planner=planner)
    meta = PredictorMeta.of(pair)
    nothing = np.zeros((meta.phases, _ROBOTS, _ROBOTS, N_OUTPUTS * meta.N, meta.layout.width))
    rehearse(pair, Agent(pair, "r1", Predictor(meta, nothing)))
