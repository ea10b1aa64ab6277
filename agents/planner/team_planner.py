"""The team's planner: one QP over all robots' forces (eq. 7, or eq. 5 for DeePC)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import nominal_forces
from quadriga.agents.planner.deepc_qp import build_model, select
from quadriga.agents.planner.optimality import Residuals
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.planner.planner_qp import (
    NO_BOUNDS,
    Condensed,
    PlannerProblem,
    condense,
    constrain,
    stance_columns,
    unpack,
)
from quadriga.agents.planner.qp_solver import NOMINAL, SOLVED, SOLVERS, Solver
from quadriga.agents.predictor.episode import Episode, team_layout
from quadriga.agents.predictor.predictor import Predictor, check_sizes
from quadriga.agents.predictor.regression import reduce
from quadriga.agents.time_grid import horizon_stance, phase_of, walking_steps
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ConfigError
from quadriga.shared.robots.conventions import Array

Collected = Callable[[], Sequence[Episode]]
Formulation = Callable[[int, NDArray[np.bool_]], Condensed]  # of contact phase and stance


@dataclass(frozen=True, slots=True)
class TeamResult:
    """Plans of all robots of one planning step, always usable.

    Attributes:
        status: "solved", or "nominal:<reason>".
        u: forces, swing legs exactly zero, (n, N, 12), N.
        y: predicted outputs, (n, N, 6).
        residuals: optimality of the QP's solution.
    """

    status: str
    u: Array
    y: Array
    residuals: Residuals


class TeamPlanner:
    """Immutable set-up of the team's planner; `step` depends on its arguments alone.

    Args:
        config: the team's configuration.
        formulation: cost and prediction for a contact phase and the team's stance (N n, 4).
        phases: how many contact phases there are.
    """

    def __init__(self, config: Config, formulation: Formulation, phases: int = 1) -> None:
        self._config, self._formulation, self._phases = config, formulation, phases
        # One factorised problem per phase and stance pattern: a memo, it changes no result.
        self._problems: dict[tuple[int, bytes], tuple[PlannerProblem, Solver]] = {}
        for step in walking_steps(config):
            self._problem(step, self._stance(step))

    def step(self, inputs: Sequence[PlannerInputs]) -> TeamResult:
        """Plan the horizon of one planning step for all robots.

        Args:
            inputs: of all robots in their order, of one step.
        """
        n, N = len(inputs), self._config.planner.N
        stance = self._stance(inputs[0].step)
        problem, solver = self._problem(inputs[0].step, stance)
        past = np.concatenate([robot.past() for robot in inputs])
        base = np.concatenate([robot.y_base for robot in inputs])
        y_des = np.concatenate([robot.y_des for robot in inputs]).ravel() - base.ravel()
        y_free = problem.condensed.free(past, y_des)
        solution = solver.solve(problem.linear_term(past, y_des), *problem.bounds(y_free - y_des))
        du, dy = unpack(problem, solution.x, y_free)
        return TeamResult(
            SOLVED if solution.status == SOLVED else with_detail(NOMINAL, solution.status),
            (nominal_forces(stance, self._config.robot.weight) + du).reshape(n, N, -1),
            (base + dy).reshape(n, N, -1),
            solution.residuals,
        )

    def _stance(self, step: int) -> NDArray[np.bool_]:
        robots = range(self._config.team.robots)
        return np.concatenate([horizon_stance(self._config, i, step) for i in robots])

    def _problem(self, step: int, stance: NDArray[np.bool_]) -> tuple[PlannerProblem, Solver]:
        key = phase_of(self._config, step, self._phases), stance.tobytes()
        entry = self._problems.get(key)
        if entry is None:
            condensed = self._formulation(key[0], stance)
            problem = constrain(self._config.planner, self._config.robot.weight, condensed, stance)
            entry = problem, SOLVERS[self._config.planner.solver](problem)
            self._problems[key] = entry
        return entry


def build_centralised(config: Config, predictor: Predictor) -> TeamPlanner:
    """The planner of eq. 7: the transition matrix of the whole team.

    Raises:
        PredictorError: the predictor's sizes are not the configuration's.
    """
    check_sizes(config, predictor)
    past = predictor.meta.past

    def formulation(phase: int, stance: NDArray[np.bool_]) -> Condensed:
        robots = range(config.team.robots)
        columns = [np.concatenate([predictor.block(i, j, phase) for i in robots]) for j in robots]
        G_past = np.concatenate([column[:, :past] for column in columns], axis=1)
        G_u = np.concatenate([column[:, past:] for column in columns], axis=1)
        return condense(config.planner, G_past, G_u, stance)

    return TeamPlanner(config, formulation, predictor.phases)


def build_deepc(config: Config, model: Condensed) -> TeamPlanner:
    """The planner of eq. 5 with g and σ eliminated.

    Args:
        config: the team's configuration.
        model: `quadriga.agents.planner.deepc_qp.build_model` of the team's data.

    Raises:
        ConfigError: output bounds, which the elimination of g does not allow.
    """
    if config.planner.output_bounds != NO_BOUNDS:
        raise ConfigError(
            "planner.output_bounds",
            repr(config.planner.output_bounds),
            repr(NO_BOUNDS),
            'with planner.kind = "deepc" the outputs are eliminated together with g',
        )
    return TeamPlanner(config, lambda _, stance: select(model, stance_columns(stance)))


def build_centralised_team(
    config: Config, predictor: Predictor, _collected: Collected
) -> TeamPlanner:
    """The planner of the kind `centralised`; see `build_centralised`."""
    return build_centralised(config, predictor)


def build_deepc_team(
    config: Config, _predictor: Predictor | None, collected: Collected
) -> TeamPlanner:
    """The planner of the kind `deepc`, from the collected episodes; see `build_deepc`."""
    planner = config.planner
    layout = team_layout(config.team.robots, planner.T_ini, planner.N)
    reduction = reduce(collected(), layout)
    return build_deepc(
        config, build_model(reduction, planner, planner.lambda_g, planner.lambda_sigma)
    )
