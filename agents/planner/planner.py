"""One agent's planner: peers' terms, free response, local QP, plan (eq. 11, 12)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import nominal_forces, nominal_table
from quadriga.agents.modes import PEER_LOST
from quadriga.agents.planner.cooperation import (
    build_team_problem,
    is_cooperative,
    kept_by_agent,
    new_plan_share,
    stay_near_last,
)
from quadriga.agents.planner.peer_terms import Peers, PeerTerms
from quadriga.agents.planner.peers import PeerSelection
from quadriga.agents.planner.qp import PlannerProblem, Residuals, build_problem
from quadriga.agents.planner.solver import NOMINAL, SOLVED, SOLVERS, SolvedQp, Solver, no_solution
from quadriga.agents.plausibility import OUTPUT_MAX
from quadriga.agents.predictor.predictor import Predictor, check_sizes
from quadriga.agents.time_grid import horizon_stance, phase_of, place_in, walking_steps
from quadriga.shared.codes import with_detail
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.jit import compiled
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
        y_nominal: predicted outputs under nominal forces, as of a plan not applied, (N, 6).
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
    """Set-up of one step of the gait's cycle; nominal forces of the horizon, (N, 12), N."""

    problem: PlannerProblem
    solver: Solver
    nominal: Array


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
        self._kept = 0.0 if self._cooperative else kept_by_agent(config)
        self._new_share = new_plan_share(config, predictor) if self._cooperative else 1.0
        self._nominal_table = nominal_table(config.robot.weight)
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

    # Any number may be measured; one that overflows shows in the result.
    @np.errstate(over="ignore", invalid="ignore")
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
        y_free, error, solved = self._solve(setup, state, inputs, peers)
        problem, solution = solved.problem, solved.solution
        x, status = solution.x, solution.status
        if self._kept and status == SOLVED:
            # Both keep the limits of forces; these are convex, so the mixture keeps them too.
            last = self._last(problem, state, inputs.step)
            if problem.keeps_outputs(last, error):
                x = (1.0 - self._kept) * x + self._kept * last
        u, du, y, y_nominal, plausible = _unpack(
            x, y_free, inputs.y_base, problem.condensed.Y_v, problem.columns, setup.nominal
        )
        if not plausible:
            # The outputs cannot be predicted: nominal forces, and the desired outputs as a guess.
            u, du, y, y_nominal = setup.nominal, np.zeros_like(du), inputs.y_des, inputs.y_des
            status = IMPLAUSIBLE if status == SOLVED else status
        status = SOLVED if status == SOLVED else with_detail(NOMINAL, status)
        about = peers.used, peers.lost, solution.residuals, solution.iterations
        result = PlanResult(status, u, du, y, y_nominal, *about)
        return PlannerState(inputs.step, du, y, state.solves + (not peers.lost)), result

    @np.errstate(over="ignore", invalid="ignore")
    def problem_of(
        self, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> SolvedQp | None:
        """The QP of `step` for the same arguments; None if a peer is lost: then no QP is solved."""
        if peers.lost:
            return None
        return self._solve(self._setup(inputs.step), state, inputs, peers)[2]

    def _solve(
        self, setup: _Setup, state: PlannerState, inputs: PlannerInputs, peers: PeerTerms
    ) -> tuple[Array, Array, SolvedQp]:
        """Build and solve the QP of a step; with y_free of eq. 11 and that less y_des, (6 N,)."""
        problem, effect = setup.problem, peers.effect
        condensed = problem.condensed
        if not isinstance(effect, np.ndarray):  # one type: machine code is made for each
            effect = np.full(len(condensed.Y_past), effect)
        past, y_free, error, f = _respond(
            (inputs.u_ini, inputs.y_ini, inputs.stance_ini, inputs.y_base_ini),
            (inputs.y_base, inputs.y_des),
            effect,
            (self._nominal_table, condensed.Y_past, condensed.F_des),
            self._cooperative,
        )
        if self._cooperative:
            f = f + condensed.F_past @ past + peers.slope
            last = self._last(problem, state, inputs.step)
            innovation = self._innovation(past, state, inputs)
            f = stay_near_last(problem, f, self._new_share, last, innovation)
        solution = no_solution(problem, PEER_LOST) if peers.lost else setup.solver.solve(f, error)
        return y_free, error, SolvedQp(problem, f, *problem.bounds(error), solution)

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

    def _setup(self, step: int) -> _Setup:
        """The set-up of a step of the gait's cycle, from the memo."""
        place = place_in(self._cycle, step)
        setup = self._setups.get(place)
        if setup is None:
            setup = self._setups[place] = self._build_setup(place)
        return setup

    def _build_setup(self, step: int) -> _Setup:
        config, index, past = self._config, self._index, self._predictor.meta.past
        stance, weight = horizon_stance(config, index, step), config.robot.weight
        if self._cooperative:
            problem = build_team_problem(config, self._predictor, index, step)
        else:
            phase = phase_of(config, step, self._predictor.phases)
            G = self._predictor.block(index, index, phase)
            problem = build_problem(config.planner, weight, G[:, past:], stance, G[:, :past])
        solver = SOLVERS[config.planner.solver](problem)
        return _Setup(problem, solver, nominal_forces(stance, weight))


# The processor's caches are lost between two steps, so a step takes mostly the time to load its
# code and data: what surrounds the QP is compiled too.


@compiled
def _respond(
    window: tuple[Array, Array, NDArray[np.bool_], Array],
    horizon: tuple[Array, Array],
    effect: Array,
    matrices: tuple[Array, Array, Array],
    cooperative: bool,
) -> tuple[Array, Array, Array, Array]:
    """What the QP of a step is made of.

    Args:
        window: u_ini, y_ini, stance_ini and y_base_ini, see `PlannerInputs`.
        horizon: y_base and y_des.
        effect: of the peers on own outputs, (6 N,).
        matrices: nominal forces by stance pattern, (16, 12), N; Y_past and F_des, see `Condensed`.
        cooperative: whether F_des belongs to the team's cost.

    Returns:
        Past deviations, (18 T_ini,); the free response, output deviations under nominal forces,
        y_free of eq. 11, (6 N,); that less the desired ones; the linear term of the own cost, or
        the part of the team's that y_des makes, (nv,).
    """
    u_ini, y_ini, stance_ini, y_base_ini = window
    y_base, y_des = horizon
    table, Y_past, F_des = matrices
    T_ini = len(u_ini)
    past = np.empty(T_ini * (N_FORCES + N_OUTPUTS))
    for k in range(T_ini):
        pattern = 0
        for leg in range(4):
            pattern = 2 * pattern + stance_ini[k, leg]
        past[N_FORCES * k : N_FORCES * (k + 1)] = u_ini[k] - table[pattern]
        at = N_FORCES * T_ini + N_OUTPUTS * k
        past[at : at + N_OUTPUTS] = y_ini[k] - y_base_ini[k]
    y_free = Y_past @ past + effect
    wanted = (y_des - y_base).ravel()
    f = F_des @ (wanted if cooperative else wanted - y_free)
    return past, y_free, y_free - wanted, f


@compiled
def _unpack(
    x: Array, y_free: Array, y_base: Array, Y_v: Array, columns: NDArray[np.int64], nominal: Array
) -> tuple[Array, Array, Array, Array, bool]:
    """Forces and their deviations, (N, 12), outputs with x and with 0, (N, 6); all plausible?"""
    deviation = np.zeros(nominal.size)
    for i in range(len(columns)):
        deviation[columns[i]] = x[i]
    du = deviation.reshape(nominal.shape)
    y = y_base + (y_free + Y_v @ x).reshape(y_base.shape)
    y_nominal = y_base + y_free.reshape(y_base.shape)
    plausible = True
    for outputs in (y, y_nominal):
        for output in outputs.flat:
            if not abs(output) <= OUTPUT_MAX:
                plausible = False
    return nominal + du, du, y, y_nominal, plausible
