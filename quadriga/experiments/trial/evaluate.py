"""A trial walked and measured in this process, whose agents and planners are made once and kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from quadriga.agents.agent import Agent
from quadriga.agents.planner.team import TeamPlanner
from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.predictor import Predictor
from quadriga.experiments.trial.figures_of_merit import Figures, compute_figures
from quadriga.experiments.trial.in_process import build_timed_agents, roll_out
from quadriga.identification.central_planner import build_central_planner, collected_of
from quadriga.shared.config.sections import Config, WorldConfig
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.runtime.arithmetic import use_one_blas_thread


def evaluate(config: Config, predictor: Path | None, data: Path | None = None) -> Figures:
    """The figures of a walk in this process.

    Args:
        config: the team's configuration.
        predictor: its file; None for a kind of planner that needs none.
        data: what the predictor was fitted to, for a kind that plans with that; None takes the
            cache's.

    Raises:
        QuadrigaError: the predictor is refused, or the data are missing.
    """
    use_one_blas_thread()  # before anything is computed: its last bits depend on their number
    # Agents and planners are kept by what they are made of, and the world is not part of that.
    fixed = replace(config, world=WorldConfig())
    central = find_kind(config.planner.kind).central
    team = _team_planner(fixed, predictor, data) if central else None
    return compute_figures(roll_out(config, _agents(fixed, predictor, data), team))


@lru_cache(maxsize=1)  # those of three robots take 70 MB, with `planner.preset = "fast"` 280
def _agents(config: Config, path: Path | None, data: Path | None) -> Mapping[str, Agent]:
    return build_timed_agents(config, _predictor(config, path), collected_of(config, data))


@lru_cache(maxsize=4)
def _predictor(config: Config, path: Path | None) -> Predictor | None:
    return None if path is None else load_checked(path, config)[0]


@lru_cache(maxsize=2)
def _team_planner(config: Config, path: Path | None, data: Path | None) -> TeamPlanner:
    return build_central_planner(config, _predictor(config, path), data)
