"""One agent's planner: peers' terms, free response, local QP, plan (eq. 11, 12)."""

from __future__ import annotations

from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import (
    horizon_stance,
    nominal_forces,
    nominal_table,
    phase_of,
    place_in,
    walking_steps,
)
from quadriga.agents.planner.cooperation import (
    build_team_problem,
    is_cooperative,
    kept_share,
    new_plan_share,
    stay_near_last,
)
from quadriga.agents.planner.foot_limits import FAILED, ForceQp, minimise
from quadriga.agents.planner.peers import PeerTerms
from quadriga.agents.planner.qp import PlannerProblem, Residuals, build_problem, unpack
from quadriga.agents.planner.solver import (
    NOMINAL,
    SOLVED,
    SOLVERS,
    DaqpSolver,
    SolvedQp,
    no_solution,
)
from quadriga.agents.plausibility import OUTPUT_MAX, are_plausible_outputs
from quadriga.agents.predictor.predictor import Predictor, check_sizes
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.modes import PEER_LOST
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled
from quadriga.shared.runtime.record import record

IMPLAUSIBLE: Final = "implausible"
_OWN_COST: Final = np.zeros(0)  # instead of a linear term: it is computed with the plan


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

    def past(self) -> Array:
        """Deviations [u_ini; y_ini]. Shape (18 T_ini,)."""
        du = self.u_ini - nominal_forces(self.stance_ini, self.weight)
        return np.concatenate([du.ravel(), (self.y_ini - self.y_base_ini).ravel()])

    def wanted(self) -> Array:
        """Deviations y_des from the base. Shape (6 N,)."""
        return (self.y_des - self.y_base).ravel()


@record
class PlannerState:
    """The agent's own last plan.

    Attributes:
        step: its planning step; −1 before the first one.
        du: its force deviations, (N, 12), N.
        y: the outputs it predicts, (N, 6).
    """

    step: int = -1
    du: Array | None = None
    y: Array | None = None


@record
class PlanResult:
    """A plan of N samples from t_k on, always finite and usable.

    Attributes:
        status: "solved", or "nominal:<reason>": nominal forces because the QP has no solution,
            a peer is lost, or no robot can reach the predicted outputs.
        u: forces, swing legs exactly zero, (N, 12), N.
        du: their deviation from nominal, (N, 12), N.
        y: predicted outputs under u, (N, 6); the desired ones where the prediction is implausible.
        y_nominal: predicted outputs under nominal forces, as of a plan not applied, (N, 6).
        residuals: optimality of the QP's solution.
        iterations: of the QP solver.
    """

    status: str
    u: Array
    du: Array
    y: Array
    y_nominal: Array
    residuals: Residuals
    iterations: int


class _Prediction(NamedTuple):
    """See `Condensed`, `PlannerProblem`; nominal forces by stance pattern, (16, 12), N."""

    Y_past: Array
    Y_v: Array
    F_des: Array
    columns: NDArray[np.int64]
    nominal: Array  # forces of the horizon, (N, 12), N
    nominal_table: Array


class Planner:
    """Immutable set-up of the planner of agent `index`, 0-based, with a `load_checked` predictor.

    Its functions depend on their arguments alone.

    Raises:
        PredictorError: the predictor's sizes are not the configuration's.
    """

    def __init__(self, config: Config, index: int, predictor: Predictor) -> None:
        check_sizes(config, predictor)
        self._config, self._index, self._predictor = config, index, predictor
        self._cycle = walking_steps(config)
        self._cooperative = is_cooperative(config)
        self._kept = 0.0 if self._cooperative else kept_share(config)
        self._new_share = new_plan_share(config, predictor) if self._cooperative else 1.0
        self._setup = cache(self._build_setup)  # of a step of the gait's cycle
        for step in self._cycle:
            self._setup(step)

    def step(
        self, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> tuple[PlannerState, PlanResult]:
        """Plan the horizon of one planning step, or plan it again with the peers' newer terms."""
        result, _ = self._solve(state, inputs, peers, as_qp=False)
        return PlannerState(inputs.step, result.du, result.y), result

    def problem_of(
        self, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> SolvedQp | None:
        """The QP of `step` for the same arguments; None if a peer is lost: then no QP is solved."""
        return self._solve(state, inputs, peers, as_qp=True)[1]

    # Any number may be measured; one that overflows shows in the result.
    @np.errstate(over="ignore", invalid="ignore")
    def _solve(
        self, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms, *, as_qp: bool
    ) -> tuple[PlanResult, SolvedQp | None]:
        """The plan by compiled code; by a solver where that fails or the QP itself is asked for."""
        problem, solver, prediction = self._setup(place_in(self._cycle, inputs.step))
        f, effect, last = _OWN_COST, peers.effect, self._last(problem, state, inputs.step)
        if self._cooperative:
            past = inputs.past()
            f = problem.linear_term(past, inputs.wanted()) + peers.slope
            innovation = self._innovation(past, state, inputs)
            f = stay_near_last(problem, f, self._new_share, last, innovation)
        if not isinstance(effect, np.ndarray):  # one type: machine code is made for each
            effect = np.full(len(prediction.Y_past), effect)
        window = inputs.u_ini, inputs.y_ini, inputs.stance_ini, inputs.y_base_ini
        forces, outputs, y_free, f, residuals, solutions = _plan_step(
            (*window, inputs.y_base, inputs.y_des),
            effect,
            f,
            (self._kept, last),
            prediction,
            solver.force_qp,
            solver.limits_feet and not peers.lost,
        )
        if solutions != FAILED and not as_qp:
            (u, du), (y, y_nominal) = forces, outputs
            return PlanResult(SOLVED, u, du, y, y_nominal, residuals, solutions), None
        error, qp, solution = y_free - inputs.wanted(), None, no_solution(problem, PEER_LOST)
        if not peers.lost:
            solution = solver.solve(f, error)
            qp = SolvedQp(problem.shifted(error), f, solution)
        x, status = solution.x, solution.status
        if self._kept and status == SOLVED:
            x = (1.0 - self._kept) * x + self._kept * last
        du, dy = unpack(problem, x, y_free)
        y, y_nominal = inputs.y_base + dy, inputs.y_base + y_free.reshape(dy.shape)
        if not (are_plausible_outputs(y) and are_plausible_outputs(y_nominal)):
            # The outputs cannot be predicted: nominal forces, and the desired outputs as a guess.
            du, y, y_nominal = np.zeros_like(du), inputs.y_des, inputs.y_des
            status = IMPLAUSIBLE if status == SOLVED else status
        status = SOLVED if status == SOLVED else with_detail(NOMINAL, status)
        u, proof = prediction.nominal + du, (solution.residuals, solution.iterations)
        return PlanResult(status, u, du, y, y_nominal, *proof), qp

    def _last(self, problem: PlannerProblem, state: PlannerState, step: int) -> Array:
        """The last plan's deviations of the QP's forces, brought forward to a step. (nv,), N."""
        skipped = self._config.planner.applied * (step - state.step)
        last = np.zeros((self._config.planner.N, N_FORCES))
        if state.du is not None and 0 <= skipped < len(last):
            last[: len(last) - skipped] = state.du[skipped:]
        return last.ravel()[problem.columns]

    def _innovation(self, past: Array, state: PlannerState, inputs: PlannerInputs) -> Array:
        """Past deviations less those that the last plan predicted; zero where it predicted none."""
        T_ini, since = len(inputs.u_ini), self._config.planner.applied * (inputs.step - state.step)
        innovation = np.zeros_like(past)
        if state.du is None or state.y is None or not 0 <= since <= T_ini:
            return innovation
        u, y = (part.reshape(T_ini, -1) for part in np.split(innovation, [N_FORCES * T_ini]))
        du_ini = past[: N_FORCES * T_ini].reshape(T_ini, -1)
        u[T_ini - since :] = du_ini[T_ini - since :] - state.du[:since]
        y[T_ini - since :] = inputs.y_ini[T_ini - since :] - state.y[:since]
        return innovation

    def _build_setup(self, step: int) -> tuple[PlannerProblem, DaqpSolver, _Prediction]:
        config, index, past = self._config, self._index, self._predictor.layout.past
        stance, weight = horizon_stance(config, index, step), config.robot.weight
        if self._cooperative:
            problem = build_team_problem(config, self._predictor, index, step)
        else:
            phase = phase_of(config, step, self._predictor.phases)
            G = self._predictor.block(index, index, phase)
            problem = build_problem(config.planner, weight, G[:, past:], stance, G[:, :past])
        solver = SOLVERS[config.planner.solver](problem)
        condensed, nominal = problem.condensed, nominal_forces(stance, weight)
        matrices = condensed.Y_past, condensed.Y_v, condensed.F_des
        prediction = _Prediction(*matrices, problem.columns, nominal, nominal_table(weight))
        return problem, solver, prediction


@compiled
def _plan_step(
    own: tuple[Array, Array, NDArray[np.bool_], Array, Array, Array],
    effect: Array,
    f: Array,
    last: tuple[float, Array],
    prediction: _Prediction,
    qp: ForceQp,
    limits_feet: bool,
) -> tuple[Array, Array, Array, Array, Residuals, int]:
    """Build, solve and unpack the QP of a step, in one call; without the fallback.

    The caches are lost between two steps: it takes mostly the time to load its code and data.

    Args:
        own: u_ini, y_ini, stance_ini, y_base_ini, y_base and y_des, see `PlannerInputs`.
        effect: of the peers on own outputs, (6 N,).
        f: linear term of the team's cost, (nv,); empty: that of the own cost.
        last: share of the last plan that is kept; its forces, (nv,), N.
        prediction: of the stance pattern.
        qp: likewise.
        limits_feet: whether `qp` is all of the QP, which then is solved here.

    Returns:
        u and du, (2, N, 12), y and y_nominal, (2, N, 6), see `PlanResult`; the free response y_free
        of eq. 11, (6 N,); f; residuals and number of solutions, see `Minimum`.
    """
    # Unpacked before the loops: each access to a tuple in a loop costs a reference count.
    u_ini, y_ini, stance_ini, y_base_ini, y_base, y_des = own
    Y_past, Y_v, F_des, columns, nominal, nominal_table = prediction
    (kept, x_last), T_ini, N = last, len(u_ini), len(y_des)
    past = np.empty(T_ini * (N_FORCES + N_OUTPUTS))
    for k in range(T_ini):
        pattern = 0
        for leg in range(4):
            pattern = 2 * pattern + stance_ini[k, leg]
        past[N_FORCES * k : N_FORCES * (k + 1)] = u_ini[k] - nominal_table[pattern]
        at = N_FORCES * T_ini + N_OUTPUTS * k
        past[at : at + N_OUTPUTS] = y_ini[k] - y_base_ini[k]
    y_free = Y_past @ past + effect
    if not len(f):
        f = F_des @ ((y_des - y_base).ravel() - y_free)
    x, residuals, solutions = x_last, Residuals(0.0, 0.0, 0.0), FAILED
    if limits_feet:
        x, _, residuals, solutions = minimise(qp, f)
    if kept:
        x = (1.0 - kept) * x + kept * x_last
    forces, outputs = np.zeros((2, N, N_FORCES)), np.empty((2, N, N_OUTPUTS))
    du = forces[1].ravel()
    for i in range(len(columns)):
        du[columns[i]] = x[i]
    forces[0] = nominal + forces[1]
    outputs[0] = y_base + (y_free + Y_v @ x).reshape(N, N_OUTPUTS)
    outputs[1] = y_base + y_free.reshape(N, N_OUTPUTS)
    for output in outputs.flat:
        if not abs(output) <= OUTPUT_MAX:
            solutions = FAILED
    return forces, outputs, y_free, f, residuals, solutions
