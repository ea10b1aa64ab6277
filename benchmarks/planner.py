"""Time of a plan on real walks: the paper's problems as written there, against ours.

Both solve every planning step of the same walks in turns, in one process with one BLAS thread.
Times are processor times, so other programs do not count. "As written" is sparse OSQP with its own
tolerances, one object warm-started from step to step. Errors of the applied forces are against OSQP
at 1e-9 on the condensed problem.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from time import thread_time
from typing import Any, Final

import numpy as np
from rich.console import Console
from scipy import sparse

from benchmarks.as_written import TIGHT, PaperQp, WarmOsqp
from benchmarks.planner_ticks import PlanningTick, record
from quadriga.agents.planner.peers import Peers
from quadriga.agents.planner.planner import Planner, PlannerState
from quadriga.agents.planner.qp import PlannerProblem, build_problem, unpack
from quadriga.agents.planner.solver import DaqpSolver
from quadriga.agents.planner.team import build_centralised
from quadriga.agents.predictor.gates import load_checked
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.predictors import ensure_predictor
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import Array

# What differs from the default world; a team that is pushed plans at its bounds.
WALKS: Final[Sequence[Mapping[str, Any]]] = (
    {}, {"terrain": "boxes"}, {"push_force": 150.0, "push_every": 0.5},
)  # fmt: skip
# The paper has one transition matrix for all of the gait, and plans that keep nothing of the last
# ones nor bring their peers' forward. Such a team need pass no gate of ours to be timed.
AS_IN_THE_PAPER: Final[Mapping[str, Any]] = {
    "identification.predictor": "ridge",
    "identification.max_peers_harm": 1000.0,
    "identification.max_radius": 10.0,
    "planner.damping": 0.0,
    "planner.compensation": False,
}
PEERS: Final = "eq. 12, with the peers' terms"
_TEAM_STEPS: Final = 12  # per walk; as written the problem of 5 robots takes most of a second
_AT_BOUND: Final = 1e-6  # N, of the exact answer

Row = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """One plan to make: of one robot (eq. 12) or of the team (eq. 7).

    Attributes:
        tick: the planning step of the walk.
        robots: whose plan.
        problem: the condensed one, by which answers are judged.
        y_free: outputs without future forces, (6 N · robots,).
        y_des: desired outputs.
    """

    tick: PlanningTick
    robots: slice
    problem: PlannerProblem
    y_free: Array
    y_des: Array


@dataclass
class Contender:
    """One way of computing a plan.

    Attributes:
        solve: force deviations of a case, N.
        times: seconds of each plan.
        errors: of each plan, the largest of the forces that are applied, N.
    """

    solve: Callable[[Case], Array]
    times: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)


def record_walks(
    robots: int, seconds: float, console: Console, seed: int
) -> tuple[Config, Predictor, list[list[PlanningTick]]]:
    """A team, its predictor, and the planning steps of its walks."""
    world = {"world.duration": seconds, "world.seed": seed}
    config = load(None, {"team.robots": robots, **world, **AS_IN_THE_PAPER})
    predictor = load_checked(ensure_predictor(config, console), config)[0]
    worlds = [replace(config.world, **changes) for changes in WALKS]
    return config, predictor, [record(replace(config, world=w), predictor) for w in worlds]


def measure(
    config: Config, predictor: Predictor, walks: Sequence[Sequence[PlanningTick]]
) -> list[Row]:
    """One row for each problem: times of the paper's way and of ours, and their errors."""
    local, team = _Local(config, predictor), _Team(config, predictor)
    own = [case for walk in walks for tick in walk for case in local.cases(tick)]
    joint = [team.case(tick) for walk in walks for tick in walk[-_TEAM_STEPS:]]
    return [
        compare("eq. 12, QP", config, own, Contender(local.as_written), Contender(local.solve)),
        compare(PEERS, config, own, Contender(local.step_as_written), Contender(local.step)),
        compare("eq. 7", config, joint, Contender(team.as_written), Contender(team.step)),
    ]


def compare(
    problem: str, config: Config, cases: Sequence[Case], written: Contender, ours: Contender
) -> Row:
    """Run both on every case, in turns the first, and judge them, at bounds of forces too."""
    for case in cases[: config.team.robots]:
        for contender in (written, ours):
            contender.solve(case)  # the first call includes the set-up
    bound = []
    for turn, case in enumerate(cases):
        exact = _reference(case)
        bound.append(_is_at_bound(case.problem, exact))
        for contender in (written, ours) if turn % 2 else (ours, written):
            begun = thread_time()
            u = contender.solve(case)
            contender.times.append(thread_time() - begun)
            contender.errors.append(_applied_error(config, case, exact, u))
    row = {"robots": config.team.robots, "problem": problem}
    row |= {"force_error_n": max(ours.errors), "written_force_error_n": max(written.errors)}
    return (
        row
        | _times("", ours, written, [True] * len(cases))
        | _times("bound_", ours, written, bound)
    )


def _times(prefix: str, ours: Contender, written: Contender, chosen: Sequence[bool]) -> Row:
    """Median and p99 of some of the plans, ms, and how many times as long the paper's way takes."""
    if not any(chosen):
        return {f"{prefix}plans": 0}
    (median, p99), (slow, slow_p99) = (
        1e3 * np.percentile(np.array(each.times)[np.array(chosen)], (50, 99))
        for each in (ours, written)
    )
    figures = {
        "plans": sum(chosen), "median_ms": median, "p99_ms": p99, "written_median_ms": slow,
        "written_p99_ms": slow_p99, "ratio_median": slow / median, "ratio_p99": slow_p99 / p99,
    }  # fmt: skip
    return {f"{prefix}{name}": float(value) for name, value in figures.items()}


def _reference(case: Case) -> Array:
    """The minimiser by OSQP at 1e-9."""
    problem, f = case.problem, case.problem.gradient @ (case.y_free - case.y_des)
    A = sparse.csc_array(np.vstack([np.eye(len(f)), problem.A]))
    settings = {**TIGHT, "polishing": 0}  # which prints a line where no bound is active
    solver = WarmOsqp(sparse.csc_array(np.triu(problem.H)), A, settings)
    x, status = solver.solve(f, problem.lower, problem.upper)
    if status != "solved":
        raise ChildProcessError(f"the reference did not converge: {status}")
    return x


def _is_at_bound(problem: PlannerProblem, x: Array) -> bool:
    """Whether any bound holds the minimiser."""
    values = np.concatenate([x, problem.A @ x])
    return bool(np.minimum(problem.upper - values, values - problem.lower).min() < _AT_BOUND)


def _applied_error(config: Config, case: Case, exact: Array, u: Array) -> float:
    best = np.zeros(u.size)
    best[case.problem.columns] = exact
    error = np.abs(u.ravel() - best).reshape(case.tick.nominal[case.robots].shape)
    return float(error[:, : config.planner.applied].max())


class _Local:
    """Eq. 12: the QP of one robot, and its whole planning step with the peers' terms."""

    def __init__(self, config: Config, predictor: Predictor) -> None:
        robots, past = range(config.team.robots), predictor.layout.past
        self._config, self._predictor = config, predictor
        self._G_u = [np.ascontiguousarray(predictor.block(i, i)[:, past:]) for i in robots]
        self._G_past = [np.ascontiguousarray(predictor.block(i, i)[:, :past]) for i in robots]
        self._planners = [Planner(config, i, predictor) for i in robots]
        self._peers = [Peers(config, i, predictor) for i in robots]
        self._paper = [PaperQp(config.planner, G_u) for G_u in self._G_u]
        self._set_up = cache(self._build)

    def cases(self, tick: PlanningTick) -> list[Case]:
        """The plans of one step; also makes the set-up that all ticks share."""
        made = []
        for i, stance in enumerate(tick.stance):
            problem, _ = self._set_up(i, stance.tobytes())
            made.append(Case(tick, slice(i, i + 1), problem, self._free(tick, i), tick.y_des[i]))
        return made

    def as_written(self, case: Case) -> Array:
        tick, own = case.tick, case.robots
        paper: PaperQp = self._paper[own.start]
        return paper.solve(case.y_free, case.y_des, tick.stance[own], tick.nominal[own]).u

    def step_as_written(self, case: Case) -> Array:
        return self.as_written(replace(case, y_free=self._free(case.tick, case.robots.start)))

    def solve(self, case: Case) -> Array:
        i, problem = case.robots.start, case.problem
        _, solver = self._set_up(i, case.tick.stance[i].tobytes())
        solution = solver.solve(problem.condensed.F_des @ (case.y_des - case.y_free))
        du: Array = unpack(problem, solution.x, case.y_free)[0]
        return du

    def step(self, case: Case) -> Array:
        i, tick = case.robots.start, case.tick
        inputs, peers = tick.inputs[i], tuple(peer for peer in tick.peers if peer.index != i)
        terms = self._peers[i].terms(peers, inputs.step, inputs.step - 1, tick.base_before)
        du: Array = self._planners[i].step(PlannerState(), inputs, terms)[1].du
        return du

    def _free(self, tick: PlanningTick, i: int) -> Array:
        """Eq. 11 without the robot's own future forces."""
        y: Array = self._G_past[i] @ tick.past[i]
        for j, before in enumerate(tick.before):
            if j != i:
                y = y + self._predictor.block(i, j) @ before
        return y

    def _build(self, i: int, stance: bytes) -> tuple[PlannerProblem, DaqpSolver]:
        problem = _build_problem(self._config, self._G_u[i], stance)
        return problem, DaqpSolver(problem)


class _Team:
    """Eq. 7: one QP for all robots, timed with all that depends on the tick."""

    def __init__(self, config: Config, predictor: Predictor) -> None:
        robots, past = range(config.team.robots), predictor.layout.past
        G = np.block([[predictor.block(i, j) for j in robots] for i in robots])
        own = np.tile(np.arange(G.shape[1] // len(robots)) < past, len(robots))
        self._G_past, self._G_u = (np.ascontiguousarray(G[:, part]) for part in (own, ~own))
        self._planner = build_centralised(config, predictor)
        self._paper = PaperQp(config.planner, self._G_u)
        self._problem = cache(lambda stance: _build_problem(config, self._G_u, stance))

    def case(self, tick: PlanningTick) -> Case:
        """The plan of one step."""
        problem = self._problem(tick.stance.tobytes())
        return Case(tick, slice(None), problem, self._free(tick), tick.y_des.ravel())

    def as_written(self, case: Case) -> Array:
        y_free, tick = self._free(case.tick), case.tick
        return self._paper.solve(y_free, case.y_des, tick.stance, tick.nominal).u

    def step(self, case: Case) -> Array:
        du: Array = self._planner.step(case.tick.inputs).u - case.tick.nominal
        return du

    def _free(self, tick: PlanningTick) -> Array:
        y: Array = self._G_past @ tick.past.ravel()
        return y


def _build_problem(config: Config, G_u: Array, stance: bytes) -> PlannerProblem:
    """The condensed problem of a stance, (…, 4) as bytes, by which set-ups are kept."""
    pattern = np.frombuffer(stance, dtype=np.bool_).reshape(-1, 4)
    return build_problem(config.planner, config.robot.weight, G_u, pattern)
