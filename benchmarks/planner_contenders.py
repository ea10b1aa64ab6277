"""The ways of computing a plan that the benchmark compares, each as one function of a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from benchmarks.as_written import DeepcQp, PaperQp
from benchmarks.planner_ticks import PlanningTick
from quadriga.agents.planner.peers import Peers
from quadriga.agents.planner.planner import Planner, PlannerState
from quadriga.agents.planner.qp import (
    PlannerProblem,
    build_problem,
    constrain,
    stance_columns,
    unpack,
)
from quadriga.agents.planner.solver import SOLVERS, DaqpSolver
from quadriga.agents.planner.team import TeamPlanner, build_centralised, build_model, select
from quadriga.agents.predictor.episode import Episode, team_layout
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.regression import reduce
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array

AS_WRITTEN = "as written"
_AT_BOUND = 1e-6  # N, of the exact answer


@dataclass(frozen=True)
class Case:
    """One plan to make: of one robot (eq. 12) or of the team (eq. 5, 7).

    Attributes:
        tick: the planning step of the walk.
        robots: whose plan.
        problem, f: the condensed problem, by which answers are judged.
        y_free: outputs without future forces, (6 N · robots,).
        y_des: desired outputs.
    """

    tick: PlanningTick
    robots: tuple[int, ...]
    problem: PlannerProblem
    f: Array
    y_free: Array
    y_des: Array


@dataclass
class Contender:
    """One way of computing a plan, with its times and errors.

    Attributes:
        problem: the one it solves; times are compared with "as written" of the same problem.
        name: the way it solves it.
        run: force deviations of a case, N.
        times: seconds of each plan.
        errors: per plan the cone's violation [N], the force error on the applied samples [N] and
            the relative gap of the objective.
    """

    problem: str
    name: str
    run: Callable[[Case], Array]
    times: list[float] = field(default_factory=list)
    errors: list[tuple[float, float, float]] = field(default_factory=list)


def is_at_bound(problem: PlannerProblem, x: Array) -> bool:
    """Whether any bound holds the minimiser."""
    values = np.concatenate([x, problem.A @ x])
    return bool(np.minimum(problem.upper - values, values - problem.lower).min() < _AT_BOUND)


class Local:
    """Eq. 12: the QP of one robot, and its whole planning step with the peers' terms."""

    def __init__(self, config: Config, predictor: Predictor) -> None:
        robots, past = range(config.team.robots), predictor.layout.past
        self._config, self._predictor, self._past = config, predictor, past
        self._G_u = [np.ascontiguousarray(predictor.block(i, i)[:, past:]) for i in robots]
        self._G_past = [np.ascontiguousarray(predictor.block(i, i)[:, :past]) for i in robots]
        self._planners = [Planner(config, i, predictor) for i in robots]
        self._peers = [Peers(config, i, predictor) for i in robots]
        self._problems: dict[tuple[int, bytes], PlannerProblem] = {}
        self._solvers: dict[tuple[str, int, bytes], DaqpSolver] = {}

    def cases(self, tick: PlanningTick) -> list[Case]:
        """The plans of one step; also makes the set-up that all ticks share."""
        made = []
        for i, stance in enumerate(tick.stance):
            key = i, stance.tobytes()
            if key not in self._problems:
                problem = build_problem(
                    self._config.planner, self._config.robot.weight, self._G_u[i], stance
                )
                self._problems[key] = problem
                for name, solver in SOLVERS.items():
                    self._solvers[name, *key] = solver(problem)
            y_free, y_des = self._free(tick, i), tick.y_des[i]
            f = self._problems[key].gradient @ (y_free - y_des)
            made.append(Case(tick, (i,), self._problems[key], f, y_free, y_des))
        return made

    def contenders(self) -> list[Contender]:
        """New contenders, so that warm-started solvers start cold."""
        paper, whole = ([PaperQp(self._config.planner, G_u) for G_u in self._G_u] for _ in range(2))

        def as_written(case: Case) -> Array:
            (i,), stance = case.robots, case.tick.stance
            answer = paper[i].solve(
                case.y_free, case.y_des, stance[i : i + 1], case.tick.nominal[i : i + 1]
            )
            return answer.u.ravel()

        def whole_as_written(case: Case) -> Array:
            (i,), tick = case.robots, case.tick
            y_free = self._free(tick, i)
            answer = whole[i].solve(
                y_free, tick.y_des[i], tick.stance[i : i + 1], tick.nominal[i : i + 1]
            )
            return answer.u.ravel()

        return [
            Contender("eq. 12, QP", AS_WRITTEN, as_written),
            *(Contender("eq. 12, QP", name, self._ours(name)) for name in SOLVERS),
            Contender("eq. 12, tick", AS_WRITTEN, whole_as_written),
            Contender("eq. 12, tick", "daqp", self._whole_tick),
        ]

    def _ours(self, name: str) -> Callable[[Case], Array]:
        def run(case: Case) -> Array:
            (i,), problem = case.robots, case.problem
            solver = self._solvers[name, i, case.tick.stance[i].tobytes()]
            solution = solver.solve(problem.condensed.F_des @ (case.y_des - case.y_free))
            return unpack(problem, solution.x, case.y_free)[0].ravel()

        return run

    def _whole_tick(self, case: Case) -> Array:
        (i,), tick = case.robots, case.tick
        planner, inputs = self._planners[i], tick.inputs[i]
        peers, step = tuple(peer for peer in tick.peers if peer.index != i), inputs.step
        terms = self._peers[i].terms(peers, step, step - 1, tick.base_before)
        return planner.step(PlannerState(), inputs, terms)[1].du.ravel()

    def _free(self, tick: PlanningTick, i: int) -> Array:
        """Eq. 11 without the robot's own future forces."""
        y: Array = self._G_past[i] @ tick.past[i]
        for j, before in enumerate(tick.before):
            if j != i:
                y = y + self._predictor.block(i, j) @ before
        return y


class Team:
    """Eq. 7: one QP for all robots."""

    def __init__(self, config: Config, predictor: Predictor) -> None:
        self._config, robots, past = config, range(config.team.robots), predictor.layout.past
        G = np.block([[predictor.block(i, j)[:, past:] for j in robots] for i in robots])
        self._G_u = np.ascontiguousarray(G)
        G = np.block([[predictor.block(i, j)[:, :past] for j in robots] for i in robots])
        self._G_past = np.ascontiguousarray(G)
        self._planner: TeamPlanner = build_centralised(config, predictor)
        self._problem = cache(self._build)

    def cases(self, tick: PlanningTick) -> list[Case]:
        """The plan of one step."""
        problem = self._problem(tick.stance.tobytes())
        y_free, y_des = self._G_past @ tick.past.ravel(), tick.y_des.ravel()
        f = problem.gradient @ (y_free - y_des)
        return [Case(tick, tuple(range(len(tick.stance))), problem, f, y_free, y_des)]

    def contenders(self) -> list[Contender]:
        """Two contenders, timed with all that depends on the tick: free response and QP."""
        paper = PaperQp(self._config.planner, self._G_u)

        def as_written(case: Case) -> Array:
            tick = case.tick
            y_free = self._G_past @ tick.past.ravel()
            return paper.solve(y_free, tick.y_des.ravel(), tick.stance, tick.nominal).u.ravel()

        def ours(case: Case) -> Array:
            return (self._planner.step(case.tick.inputs).u - case.tick.nominal).ravel()

        return [Contender("eq. 7", AS_WRITTEN, as_written), Contender("eq. 7", "daqp", ours)]

    def _build(self, stance: bytes) -> PlannerProblem:
        pattern = np.frombuffer(stance, dtype=np.bool_).reshape(-1, 4)
        return build_problem(self._config.planner, self._config.robot.weight, self._G_u, pattern)


class TeamDeepc:
    """Eq. 5: DeePC of the team, with g and σ or without."""

    def __init__(self, config: Config, episodes: tuple[Episode, ...]) -> None:
        planner = config.planner
        self._config, self._episodes = config, episodes
        reduction = reduce(episodes, team_layout(config.team.robots, planner.T_ini, planner.N))
        self._model = build_model(reduction, planner)
        self._set_up = cache(self._build)

    def cases(self, tick: PlanningTick) -> list[Case]:
        """The plan of one step."""
        problem, _ = self._set_up(tick.stance.tobytes())
        past, y_des = tick.past.ravel(), tick.y_des.ravel()
        y_free = problem.condensed.free(past, y_des)
        robots = tuple(range(len(tick.stance)))
        return [Case(tick, robots, problem, problem.linear_term(past, y_des), y_free, y_des)]

    def contenders(self) -> list[Contender]:
        """Two contenders, timed with all that depends on the tick."""
        planner = self._config.planner
        paper = DeepcQp(planner, self._episodes, planner.lambda_g, planner.lambda_sigma)

        def as_written(case: Case) -> Array:
            tick = case.tick
            return paper.solve(tick.past.ravel(), case.y_des, tick.stance, tick.nominal).u.ravel()

        def ours(case: Case) -> Array:
            problem, solver = self._set_up(case.tick.stance.tobytes())
            past = case.tick.past.ravel()
            y_free = problem.condensed.free(past, case.y_des)
            solution = solver.solve(problem.linear_term(past, case.y_des))
            return unpack(problem, solution.x, y_free)[0].ravel()

        return [Contender("eq. 5", AS_WRITTEN, as_written), Contender("eq. 5", "daqp", ours)]

    def _build(self, stance: bytes) -> tuple[PlannerProblem, DaqpSolver]:
        pattern = np.frombuffer(stance, dtype=np.bool_).reshape(-1, 4)
        condensed = select(self._model, stance_columns(pattern))
        problem = constrain(self._config.planner, self._config.robot.weight, condensed, pattern)
        return problem, SOLVERS["daqp"](problem)
