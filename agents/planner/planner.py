"""One agent's planner: peers' terms, free response, local QP, plan (eq. 11, 12)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import nominal_forces, nominal_table
from quadriga.agents.planner.compiled_step import CompiledStep, OwnWindow, past_deviations
from quadriga.agents.planner.cooperation import (
    build_team_problem,
    is_cooperative,
    new_plan_share,
    stay_near_last,
)
from quadriga.agents.planner.damping import kept_by_agent
from quadriga.agents.planner.neighbours import PeerSelection
from quadriga.agents.planner.optimality import Residuals
from quadriga.agents.planner.peer_terms import Peers, PeerTerms
from quadriga.agents.planner.planner_qp import PlannerProblem, build_problem, unpack
from quadriga.agents.planner.qp_solver import (
    NOMINAL,
    SOLVED,
    SOLVERS,
    SolvedQp,
    Solver,
    no_solution,
)
from quadriga.agents.plausibility import are_plausible_outputs
from quadriga.agents.predictor.predictor import Predictor, check_sizes
from quadriga.agents.time_grid import horizon_stance, phase_of, place_in, walking_steps
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.modes import PEER_LOST
from quadriga.shared.robots.conventions import Array
from quadriga.shared.runtime.record import record

IMPLAUSIBLE: Final = "implausible"


@record
class PlannerInputs:
    """The agent's own data for planning step k, at time t_k = step · step_ms.

    Attributes:
        step: k.
        u_ini: own forces of the last T_ini samples, the last one ending at t_k, (T_ini, 12), N.
        y_ini: own outputs at the ends of these samples, (T_ini, 6).
        stance_ini: the stance that the nominal forces of these samples belong to, (T_ini, 4).
        y_base_ini: base of the outputs (`output_base`) at the ends of these samples, (T_ini, 6).
        y_base: base over the horizon, at the ends of its N samples, (N, 6).
        y_des: desired outputs over the horizon, (N, 6).
        weight: of the robot, N.
    """

    step: int
    u_ini: Array
    y_ini: Array
    stance_ini: NDArray[np.bool_]
    y_base_ini: Array
    y_base: Array
    y_des: Array
    weight: float

    def window(self) -> OwnWindow:
        """The same for the compiled step."""
        return OwnWindow(
            self.u_ini, self.y_ini, self.stance_ini, self.y_base_ini, self.y_base, self.y_des
        )

    def past(self) -> Array:
        """Deviations [u_ini; y_ini]. Shape (18 T_ini,)."""
        du = self.u_ini - nominal_forces(self.stance_ini, self.weight)
        return np.concatenate([du.ravel(), (self.y_ini - self.y_base_ini).ravel()])


@record
class PlannerState:
    """The agent's own last plan.

    Attributes:
        step: its planning step; −1 before the first one.
        du: its force deviations, (N, 12), N.
        y: the outputs it predicts, (N, 6).
        solves: QPs solved so far.
    """

    step: int = -1
    du: Array | None = None
    y: Array | None = None
    solves: int = 0


@record
class PlanResult:
    """A plan of N samples from t_k on, always finite and usable.

    Attributes:
        status: "solved", or "nominal:<reason>": nominal forces because the QP has no solution,
            a peer is lost, or no robot can reach the predicted outputs.
        u: forces, swing legs exactly zero, (N, 12), N.
        du: their deviation from nominal, (N, 12), N.
        y: predicted outputs under u, (N, 6); the desired ones where the prediction is implausible.
        y_nominal: predicted outputs under nominal forces, for a plan that is faded, (N, 6).
        used: step of the plan used, by peer.
        lost: peers given up; the agent stops if there are any.
        residuals: optimality of the QP's solution.
        iterations: of the QP solver.
    """

    status: str
    u: Array
    du: Array
    y: Array
    y_nominal: Array
    used: Mapping[str, int]
    lost: tuple[str, ...]
    residuals: Residuals
    iterations: int


@record
class _Setup:
    """Set-up of one step of the gait's cycle; nominal forces of the horizon, (N, 12), N.

    `none` are no deviations of the QP's forces, (nv,), N.
    """

    problem: PlannerProblem
    solver: Solver
    nominal: Array
    compiled: CompiledStep | None
    none: Array


class Planner:
    """Immutable set-up of one agent's planner; its functions depend on their arguments alone.

    Args:
        config: the team's configuration.
        index: this agent's place in the team, 0-based.
        predictor: fitted for this team (see `load_checked`).

    Raises:
        PredictorError: the predictor's sizes are not the configuration's.
    """

    def __init__(self, config: Config, index: int, predictor: Predictor) -> None:
        check_sizes(config, predictor)
        self._config, self._index, self._predictor = config, index, predictor
        self._cycle, self._peers = walking_steps(config), Peers(config, index, predictor)
        self._cooperative = is_cooperative(config)
        self._kept = kept_by_agent(config)
        self._new_share = new_plan_share(config, predictor) if self._cooperative else 1.0
        # Memo of the set-ups, one for each step of the gait's cycle; it changes no result.
        self._setups: dict[int, _Setup] = {}
        for step in self._cycle:
            self._setup(step)

    def initial(self) -> PlannerState:
        """No plan made yet."""
        return PlannerState()

    def peer_terms(
        self, before: PeerTerms, selection: PeerSelection, step: int, y_base: Array
    ) -> PeerTerms:
        """See `Peers.terms`."""
        return self._peers.terms(before, selection, step, y_base)

    def step(
        self, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> tuple[PlannerState, PlanResult]:
        """Plan the horizon of one planning step, or plan it again with the peers' newer terms.

        Args:
            state: the last plan.
            inputs: the agent's own data.
            peers: the peers' terms of eq. 11.
        """
        setup = self._setup(inputs.step)
        if setup.compiled is not None and not peers.lost:
            result = self._plan_compiled(setup, setup.compiled, state, inputs, peers)
            if result is not None:
                return PlannerState(inputs.step, result.du, result.y, state.solves + 1), result
        # Any number may be measured; one that overflows shows in the result.
        with np.errstate(over="ignore", invalid="ignore"):
            return self._plan_by_solver(setup, state, inputs, peers)

    def problem_of(
        self, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> SolvedQp | None:
        """The QP of `step` for the same arguments; None if a peer is lost: then no QP is solved."""
        if peers.lost:
            return None
        setup = self._setup(inputs.step)
        with np.errstate(over="ignore", invalid="ignore"):
            return self._solve(setup, state, inputs, peers, _free_response(setup, inputs, peers))

    def _plan_compiled(
        self,
        setup: _Setup,
        step: CompiledStep,
        state: PlannerState,
        inputs: PlannerInputs,
        peers: PeerTerms,
    ) -> PlanResult | None:
        """The plan unless a solver or a fallback has to make it."""
        last = self._last(setup.problem, state, inputs.step) if self._kept else setup.none
        plan = step.plan(inputs.window(), peers.effect, last)
        if plan is None:
            return None
        u, du, y, y_nominal, residuals, iterations = plan
        return PlanResult(
            SOLVED, u, du, y, y_nominal, peers.used, peers.lost, residuals, iterations
        )

    def _plan_by_solver(
        self, setup: _Setup, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> tuple[PlannerState, PlanResult]:
        """The plan by a solver, or the fallback where there is none."""
        problem = setup.problem
        y_free = _free_response(setup, inputs, peers)
        if peers.lost:
            solution, solves = no_solution(problem, PEER_LOST), 0
            x = solution.x
        else:
            solved, solves = self._solve(setup, state, inputs, peers, y_free), 1
            solution = solved.solution
            x = self._mix_with_last(solved, state, inputs.step)
        status = solution.status
        du, dy = unpack(problem, x, y_free)
        y, y_nominal = inputs.y_base + dy, inputs.y_base + y_free.reshape(dy.shape)
        if not (are_plausible_outputs(y) and are_plausible_outputs(y_nominal)):
            # The outputs cannot be predicted: nominal forces, and the desired outputs as a guess.
            du, y, y_nominal = np.zeros_like(du), inputs.y_des, inputs.y_des
            status = IMPLAUSIBLE if status == SOLVED else status
        result = PlanResult(
            status=SOLVED if status == SOLVED else with_detail(NOMINAL, status),
            u=setup.nominal + du,
            du=du,
            y=y,
            y_nominal=y_nominal,
            used=peers.used,
            lost=peers.lost,
            residuals=solution.residuals,
            iterations=solution.iterations,
        )
        return PlannerState(inputs.step, du, y, state.solves + solves), result

    def _solve(
        self,
        setup: _Setup,
        state: PlannerState,
        inputs: PlannerInputs,
        peers: PeerTerms,
        y_free: Array,
    ) -> SolvedQp:
        """Solve the QP of a step with this free response of the agent's own outputs."""
        problem, y_des = setup.problem, (inputs.y_des - inputs.y_base).ravel()
        error = y_free - y_des
        if self._cooperative:
            f = problem.linear_term(inputs.past(), y_des) + peers.slope
            last, news = self._last(problem, state, inputs.step), self._news(state, inputs)
            f = stay_near_last(problem, f, self._new_share, last, news)
        else:
            f = problem.gradient @ error
        lower, upper = problem.bounds(error)
        solution = setup.solver.solve(f, lower, upper)
        return SolvedQp(
            problem,
            f,
            problem.lower if lower is None else lower,
            problem.upper if upper is None else upper,
            solution,
        )

    def _mix_with_last(self, solved: SolvedQp, state: PlannerState, step: int) -> Array:
        """Mix a best response with a share of the last plan, which is nominal beyond its end.

        Both satisfy the constraints on forces; these are convex, so the mixture satisfies them too.
        A last plan that would break bounds on outputs by now is not kept.
        """
        problem, x = solved.problem, solved.solution.x
        if not self._kept or self._cooperative or solved.solution.status != SOLVED:
            return x
        share, last = self._kept, self._last(problem, state, step)
        if not problem.keeps_outputs(last, solved.lower, solved.upper):
            return x
        mixed: Array = (1.0 - share) * x + share * last
        return mixed

    def _last(self, problem: PlannerProblem, state: PlannerState, step: int) -> Array:
        """The last plan's deviations of the QP's forces, brought forward to a step. (nv,), N."""
        skipped = self._config.planner.applied * (step - state.step)
        last = np.zeros((self._config.planner.N, 12))
        if state.du is not None and 0 <= skipped < len(last):
            last[: len(last) - skipped] = state.du[skipped:]
        return last.ravel()[problem.columns]

    def _news(self, state: PlannerState, inputs: PlannerInputs) -> Array:
        """Past deviations less those that the last plan predicted; zero where it predicted none."""
        T_ini, since = len(inputs.u_ini), self._config.planner.applied * (inputs.step - state.step)
        news = inputs.past()
        if state.du is None or state.y is None or not 0 <= since <= T_ini:
            return np.zeros_like(news)
        u, y = news[: 12 * T_ini].reshape(T_ini, 12), news[12 * T_ini :].reshape(T_ini, 6)
        u[: T_ini - since] = y[: T_ini - since] = 0.0
        u[T_ini - since :] -= state.du[:since]
        y[T_ini - since :] = inputs.y_ini[T_ini - since :] - state.y[:since]
        return news

    def _setup(self, step: int) -> _Setup:
        """The set-up of a step of the gait's cycle, from the memo."""
        place = place_in(self._cycle, step)
        setup = self._setups.get(place)
        if setup is None:
            setup = self._setups[place] = self._build_setup(place)
        return setup

    def _build_setup(self, step: int) -> _Setup:
        past, weight = self._predictor.meta.past, self._config.robot.weight
        stance = horizon_stance(self._config, self._index, step)
        if self._cooperative:
            problem = build_team_problem(self._config, self._predictor, self._index, step)
        else:
            phase = phase_of(self._config, step, self._predictor.phases)
            G_ii = self._predictor.block(self._index, self._index, phase)
            problem = build_problem(
                self._config.planner, weight, G_ii[:, past:], stance, G_ii[:, :past]
            )
        solver = SOLVERS[self._config.planner.solver](problem)
        nominal = nominal_forces(stance, weight)
        qp, table = None if self._cooperative else solver.compiled, nominal_table(weight)
        made = None if qp is None else CompiledStep(problem, qp, nominal, table, self._kept)
        return _Setup(problem, solver, nominal, made, np.zeros(len(problem.columns)))


def _free_response(setup: _Setup, inputs: PlannerInputs, peers: PeerTerms) -> Array:
    """Output deviations under nominal forces, y_free of eq. 11. Shape (6 N,)."""
    table = nominal_table(inputs.weight)
    past = past_deviations(inputs.u_ini, inputs.y_ini, inputs.stance_ini, inputs.y_base_ini, table)
    y_free: Array = setup.problem.condensed.Y_past @ past + peers.effect
    return y_free
