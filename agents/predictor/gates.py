"""Which predictors a team may walk with: four figures, their limits, and the files that pass.

Held-out error, height gain and effect of peers are measured with data that the fit has not seen.
The radius of the iteration of plans is one of the planner's own QPs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import linalg
from scipy.special import stdtrit

from quadriga.agents.gait import distinct_steps, horizon_stance, phase_of, walking_steps
from quadriga.agents.planner.cooperation import (
    OWN,
    TEAM,
    cooperative_radius,
    cost_of,
    is_cooperative,
    kept_share,
)
from quadriga.agents.planner.qp import PlannerProblem, build_problem
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.agents.predictor.regression import scaled_blocks
from quadriga.agents.predictor.store import REMEDY, load, not_a_predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError, PredictorFileError
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import N_LEGS, OUTPUTS, Array
from quadriga.shared.runtime.npz import UNREADABLE
from quadriga.shared.topics import SAMPLE_MS

GAIN_TIMES: Final = (0.1, 0.25)  # s after a step of force, when the height response is compared
_GAIN_FORCE: Final = 10.0  # N, on the robot looked at
_BLOCK: Final = 100  # windows: 1 s, longer than a window's errors are alike
_TAIL: Final = 0.975  # of the two-sided interval
_SAME: Final = 1e-6  # relative: other machines have other last digits, other costs differ by more
# Fields of the meta that must be as configured, beside the controller's keys.
_MATCHED: Final = (
    "robots", "robot", "stance_ms", "alternate_phase", "yokes", "interface", "N", "T_ini",
)  # fmt: skip


class Bounds(NamedTuple):
    """An estimate with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class GateReport:
    """Figures of a predictor, stored in its file; `check` holds them against their limits.

    Attributes:
        windows: held-out windows predicted.
        rmse: held-out error per output over the horizon, all robots [m, m/s, rad, rad/s].
        rmse_persistence: the same for holding the last measured output.
        error: scaled error of all outputs together over that of persistence.
        gains: predicted over physical height response, per robot and time of `GAIN_TIMES`, of the
            worst phase.
        radius: spectral radius of the iteration of the agents' plans, the worst of all stance
            patterns and phases.
        cost: that the agents minimise: "own", then the plans are best responses; "team".
        cost_probes: tell the QPs that the radius was computed for.
        harm: by output, (‖r − p‖² − ‖r‖²) / ‖r‖² on held-out data, where p is the part of a
            prediction that is due to the peers' forces within the horizon, and r what is measured
            less all other parts: how much p raises the squared error, negative if it helps. Empty
            of a single robot, and of less than 1.5 s held out, which tell no interval.
    """

    windows: int
    rmse: Mapping[str, float]
    rmse_persistence: Mapping[str, float]
    error: float
    gains: tuple[tuple[float, ...], ...]
    radius: float
    cost: str = OWN
    cost_probes: tuple[float, ...] = ()
    harm: Mapping[str, Bounds] = field(default_factory=dict)

    @property
    def iteration(self) -> str:
        """What is iterated, in words."""
        return "best-response" if self.cost == OWN else "cooperative"

    def radius_limit(self, config: Config) -> float:
        """What the radius must be below.

        Cooperative plans converge wherever it is below 1, bounds or not. Of best responses none
        knows where bounds are active, hence the margin `identification.max_radius`.
        """
        return 1.0 if self.cost == TEAM else config.identification.max_radius

    def check(self, config: Config) -> None:
        """Refuse the predictor if a figure is beyond its limit.

        The radius and the effect of peers matter only if the agents respond to each other's plans.

        Raises:
            PredictorError: a figure is beyond its limit; the message names both.
        """
        if not self.error < 1.0:
            raise PredictorError(
                "predictor: held-out error",
                f"{self.error:.3f} of persistence",
                "below 1",
                "too little data, or a plant that the data do not show; collect more",
            )
        limits = config.identification
        low, high = limits.gain_range
        for robot, row in enumerate(self.gains, start=1):
            for time, gain in zip(GAIN_TIMES, row, strict=True):
                if not low <= gain <= high:
                    raise PredictorError(
                        f"predictor: height gain of r{robot} at {time:g} s",
                        f"{gain:.2f}",
                        f"{low:g} … {high:g} of the physical response",
                        "forces in the data that follow the outputs (feedback bias), "
                        "or a controller stiffer than the interface assumes",
                    )
        if not find_kind(config.planner.kind).needs_peers:
            return
        if not self.radius < self.radius_limit(config):
            remedy = "leave planner.damping at 0, which chooses it"
            if self.cost == OWN:
                remedy = (
                    "damp them by planner.damping, plan with planner.cost = 'team', or, of a ridge "
                    "fit, raise identification.block_weight"
                )
            raise PredictorError(
                f"predictor: radius of the {self.iteration} map",
                f"{self.radius:.3f}",
                f"below {self.radius_limit(config):g}",
                f"the agents' plans would diverge; {remedy}",
            )
        for output, harm in self.harm.items():
            if harm.low > limits.max_peers_harm:
                raise PredictorError(
                    f"predictor: effect of peers on {output}",
                    f"{100 * harm.value:.0f} % more squared error on held-out data than without it",
                    f"certainly at most {100 * limits.max_peers_harm:g} %",
                    "invented from noise: more data, or a larger identification.block_weight",
                )


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a team's predictor comes from.

    Attributes:
        config_digest: of the configuration that the data were collected with.
        seeds: of the training episodes.
        samples: of each training episode, at 100 Hz.
        held_out: samples of each episode held out.
        versions: of the packages that took part.
        gates: figures of its gates.
        fit_seconds: wall-clock time of the fit alone; None: unknown.
    """

    config_digest: str
    seeds: tuple[int, ...]
    samples: tuple[int, ...]
    held_out: tuple[int, ...]
    versions: Mapping[str, str]
    gates: GateReport
    fit_seconds: float | None = None

    @classmethod
    def from_dict(cls, body: Mapping[str, Any]) -> Provenance:
        """The inverse of `asdict`, also after JSON has made lists of tuples.

        Raises:
            TypeError, KeyError: fields are missing.
        """
        gates: dict[str, Any] = dict(body["gates"])
        gates["gains"] = tuple(tuple(row) for row in gates["gains"])
        gates["harm"] = {name: Bounds(*three) for name, three in gates.get("harm", {}).items()}
        report = GateReport(**_fields_of(GateReport, gates))
        return cls(**_fields_of(cls, {**body, "gates": report}))


def _fields_of(kind: type[Any], body: Mapping[str, Any]) -> dict[str, Any]:
    """The entries that a dataclass has fields for, lists as tuples."""
    names = {each.name for each in fields(kind)}
    return {k: tuple(v) if isinstance(v, list) else v for k, v in body.items() if k in names}


# ---- files


def read(path: Path) -> tuple[Predictor, Provenance]:
    """Read the predictor of a team, whatever its gates say.

    Raises:
        PredictorFileError: no such file, not a predictor of a team, or corrupt.
    """
    predictor, provenance = load(path)
    try:
        return predictor, Provenance.from_dict(provenance)
    except UNREADABLE as error:
        raise not_a_predictor(path, error) from None


def load_checked(path: Path, config: Config) -> tuple[Predictor, Provenance]:
    """Read a predictor and refuse any that is not for this team or has not passed its gates.

    The figures are compared with the limits of `config`. If the agents respond to each other's
    plans, and their QPs are not those that the stored radius is of, it is computed again.

    Raises:
        PredictorFileError: no such file, not a predictor, corrupt, fitted for another team, gait,
            horizon, interface or low level.
        PredictorError: a figure is beyond its gate's limit.
    """
    predictor, provenance = read(path)
    check_fitted_for(config, path, predictor)
    gates = gates_in_force(provenance.gates, config, predictor)
    gates.check(config)
    return predictor, replace(provenance, gates=gates)


def check_fitted_for(config: Config, path: Path, predictor: Predictor) -> None:
    """Refuse a predictor, read from `path`, of another team, gait, horizon or low level.

    Raises:
        PredictorFileError: it was fitted for another setting.
    """
    got, expected = predictor.meta, PredictorMeta.of(config)
    pairs = [(name, getattr(got, name), getattr(expected, name)) for name in _MATCHED]
    fitted = dict(got.controller)
    pairs += [(f"controller.{k}", fitted.get(k), wanted) for k, wanted in expected.controller]
    for name, stored, wanted in pairs:
        if stored != wanted:
            raise PredictorFileError(
                f"predictor {path}: {name}",
                repr(stored),
                f"{wanted!r} as configured",
                f"fitted for another setting; {REMEDY}",
            )


def gates_in_force(gates: GateReport, config: Config, predictor: Predictor) -> GateReport:
    """The figures that are stored with a predictor, with the radius of the QPs of `config`."""
    if not find_kind(config.planner.kind).needs_peers:
        return gates
    probes = probe_costs(config, predictor)
    if are_same_costs(probes, gates.cost_probes):
        return gates
    radius = iteration_radius(config, predictor)
    return replace(gates, radius=radius, cost=cost_of(config), cost_probes=probes)


def run_gates(config: Config, predictor: Predictor, held_out: Sequence[Episode]) -> GateReport:
    """Measure the figures of a predictor on episodes that its fit has not seen.

    Raises:
        PredictorError: no held-out episode is long enough.
    """
    windows, rmse, persistence, error = held_out_error(predictor, held_out)
    return GateReport(
        windows=windows,
        rmse=dict(zip(OUTPUTS, rmse, strict=True)),
        rmse_persistence=dict(zip(OUTPUTS, persistence, strict=True)),
        error=error,
        gains=tuple(tuple(row) for row in height_gains(config, predictor).tolist()),
        radius=iteration_radius(config, predictor),
        cost=cost_of(config),
        cost_probes=probe_costs(config, predictor),
        harm=peers_harm(predictor, held_out),
    )


# ---- held-out error


def squared_errors(predictor: Predictor, held_out: Sequence[Episode]) -> tuple[int, Array, Array]:
    """Mean squared errors of the windows of all held-out episodes and agents.

    Persistence holds the last measured output y, not its deviation.

    Returns:
        The number of windows; the errors of the predictor and of persistence, by sample of the
        horizon and output, shape (N, p) each.

    Raises:
        PredictorError: no held-out episode is long enough for a window.
    """
    layout = predictor.layout
    T_ini, N, n, p = layout.T_ini, layout.N, layout.agents, layout.outputs
    squares, naive, count = np.zeros((N, p)), np.zeros((N, p)), 0
    for episode, phases, z, dy in _windows(predictor, held_out):
        windows = len(phases)
        error = _predict(predictor, phases, z) - dy
        squares += (error.reshape(n, N, p, windows) ** 2).sum(axis=(0, 3))
        future = sliding_window_view(episode.y[T_ini:], N, axis=0)  # (C, n, p, N)
        last = episode.y[T_ini - 1 : T_ini - 1 + windows, ..., None]
        naive += ((future - last) ** 2).sum(axis=(0, 1)).T
        count += windows
    if count == 0:
        raise PredictorError(
            "held-out data",
            "no episode that long",
            f"at least {T_ini + N} samples",
            "did every held-out walk end in a fall?",
        )
    return count, squares / (count * n), naive / (count * n)


def held_out_error(
    predictor: Predictor, held_out: Sequence[Episode]
) -> tuple[int, list[float], list[float], float]:
    """Number of windows, RMSE per output, RMSE of persistence, and the ratio of scaled errors.

    Of any plant: below a ratio of 1 the predictor is of use.
    """
    count, squares, naive = squared_errors(predictor, held_out)
    rmse, persistence = np.sqrt(squares.mean(axis=0)), np.sqrt(naive.mean(axis=0))
    y_scale = np.array(predictor.layout.y_scale)
    ratio = np.linalg.norm(rmse / y_scale) / np.linalg.norm(persistence / y_scale)
    return count, rmse.tolist(), persistence.tolist(), float(ratio)


def _windows(
    predictor: Predictor, episodes: Iterable[Episode]
) -> Iterable[tuple[Episode, NDArray[np.int64], Array, Array]]:
    """Episodes that are long enough, with each window's phase at the end of its past, z and y."""
    layout, period = predictor.layout, predictor.meta.period
    for episode in episodes:
        if episode.samples >= layout.T_ini + layout.N:
            z, dy = episode.windows(layout.T_ini, layout.N)
            ends = layout.T_ini - 1 + np.arange(z.shape[2])
            since = episode.first_tick + period.sample * ends - period.begin
            yield episode, since % period.ticks * predictor.phases // period.ticks, z, dy


def _predict(predictor: Predictor, phases: NDArray[np.int64], z: Array) -> Array:
    """Predicted output deviations of windows, each by the G of its phase. Shape (n, p N, C)."""
    y = np.empty((len(z), predictor.layout.rows, z.shape[2]))
    for phase in np.unique(phases):
        now = phases == phase
        y[:, :, now] = predictor.predict(z[:, :, now], int(phase))
    return y


# ---- height gain and coupling


def height_gains(config: Config, predictor: Predictor) -> Array:
    """Predicted over physical height response to a vertical force on one robot's stance feet.

    Each gain is averaged over the stance patterns of a phase; among the phases the one farthest
    from 1 counts. Shape (n, 2): robot, time of `GAIN_TIMES`.
    """
    layout = predictor.layout
    N, n = layout.N, layout.agents
    physical = physical_height(config, N)
    rows = [min(round(1000 * time / SAMPLE_MS), N) - 1 for time in GAIN_TIMES]
    by_phase: dict[int, list[int]] = {}
    for step in walking_steps(config):
        by_phase.setdefault(phase_of(config, step, predictor.phases), []).append(step)
    gains = np.empty((len(by_phase), n, len(rows)))
    for k, (phase, steps) in enumerate(by_phase.items()):
        for robot in range(n):
            patterns = np.array([horizon_stance(config, robot, step) for step in steps])
            share = (patterns / patterns.sum(axis=2, keepdims=True)).mean(axis=0)
            du = np.zeros((N, N_LEGS, 3))
            du[:, :, 2] = _GAIN_FORCE * share
            dy = predictor.future_block(robot, robot, phase) @ du.ravel()
            gains[k, robot] = dy.reshape(N, layout.outputs)[rows, 0] / physical[rows]
    worst = np.abs(gains - 1.0).argmax(axis=0)
    greatest: Array = np.take_along_axis(gains, worst[None], axis=0)[0]
    return greatest


def physical_height(config: Config, N: int) -> Array:
    """Height response to the test force at the ends of N samples. Shape (N,), m.

    The low level closes its loop on the height, a = −kp z − kd z' − ki ∫z. "feedforward" adds
    the force to it, z'' = F/m + a. With "force" the whole-body QP weighs the force it is asked
    for against a: on two stance legs γ₂/2·|f − f_des|² + γ₃/2·(z'' − a)² is least at
    z'' = α F/m + (1 − α) a with α = 1/(1 + 2 γ₃/(γ₂ m²)).
    """
    controller, mass = config.controller, config.robot.mass
    passed, share = 1.0, 1.0
    if config.planner.interface == "force":
        stiffness = 2.0 * controller.gamma_defect / (controller.gamma_force * mass**2)
        passed = 1.0 / (1.0 + stiffness)
        share = 1.0 - passed
    gains = (controller.ki_z, controller.kp_z, controller.kd_z)
    A = np.zeros((4, 4))  # ∫z, z, z', 1
    A[0, 1] = A[1, 2] = 1.0
    A[2, 3] = passed * _GAIN_FORCE / mass
    A[2, :3] = -share * np.array(gains)
    step = linalg.expm(A * SAMPLE_MS / 1000.0)
    state = np.array([0.0, 0.0, 0.0, 1.0])
    z = np.empty(N)
    for k in range(N):
        state = step @ state
        z[k] = state[1]
    return z


def coupling_table(predictor: Predictor) -> Array:
    """Frobenius norms of the blocks G_ij of the scaled predictor, largest phase. Shape (n, n)."""
    agents, layout = range(predictor.layout.agents), predictor.layout
    norms = [
        [
            [np.linalg.norm(scaled_blocks(predictor.block(i, j, phase), layout)) for j in agents]
            for i in agents
        ]
        for phase in range(predictor.phases)
    ]
    table: Array = np.max(norms, axis=0)
    return table


# ---- effect of peers


def peers_harm(predictor: Predictor, held_out: Sequence[Episode]) -> dict[str, Bounds]:
    """How much the predicted effect of the peers' forces raises the squared error, by output.

    The forces of the data are random and independent between robots, so that no walk is needed
    twice, and data of real robots will do. Sums over blocks of windows; the interval is that of the
    delta method for a ratio of such sums, with Student's t (Cochran, Sampling Techniques, 3rd ed.,
    section 6.3).
    """
    layout, blocks = predictor.layout, []
    if layout.agents == 1:
        return {}
    for _, phases, z, dy in _windows(predictor, held_out):
        peers = _peers_part(predictor, phases, z[:, layout.past :])
        error = dy - _predict(predictor, phases, z)
        squares = np.array([error**2, (error + peers) ** 2])
        by_window = squares.reshape(2, layout.agents, layout.N, layout.outputs, -1).sum(axis=(1, 2))
        count = max(1, round(len(phases) / _BLOCK))
        blocks += [part.sum(axis=2) for part in np.array_split(by_window, count, axis=2)]
    F = len(blocks)
    if F < 2:
        return {}
    whole, without = np.moveaxis(np.array(blocks), 1, 0)  # each of shape (F, 6)
    more, total = whole - without, without.sum(axis=0)
    ratio = more.sum(axis=0) / total
    spread = ((more - ratio * without) ** 2).sum(axis=0) * F / (F - 1)
    reach = stdtrit(F - 1, _TAIL) * np.sqrt(spread) / total
    rows = np.stack([ratio, ratio - reach, ratio + reach], axis=1).tolist()
    return {name: Bounds(*row) for name, row in zip(OUTPUTS, rows, strict=True)}


def _peers_part(predictor: Predictor, phases: NDArray[np.int64], u: Array) -> Array:
    """Part of predictions due to the peers' forces u of the horizon, (n, 12 N, C). (n, 6 N, C)."""
    agents, peers = range(len(u)), np.zeros((len(u), predictor.layout.rows, u.shape[2]))
    for phase in np.unique(phases):
        now = phases == phase
        for i, j in ((i, j) for i in agents for j in agents if i != j):
            peers[i][:, now] += predictor.future_block(i, j, int(phase)) @ u[j][:, now]
    return peers


# ---- whether the iteration of the agents' plans converges


def best_response_map(config: Config, predictor: Predictor, step: int) -> Array:
    """The linear map from all agents' present plans to their next, without inequality constraints.

    U_i ← −(1 − d) H_ii⁻¹ G_iiᵀ Q̄ Σ_{j≠i} G_ij U_j + d U_i over the stance legs of planning step
    `step`, with the G of its phase and the damping d. H_ii is that of the QP that is solved.
    Shape (s, s), s being the number of stance forces of the team (150 per robot at N = 25).
    """
    phase, problems = phase_of(config, step, predictor.phases), _problems(config, predictor, step)
    rows = []
    for i, own in enumerate(problems):
        coupling = [
            np.zeros_like(own.H)
            if i == j
            else own.gradient @ predictor.future_block(i, j, phase)[:, peer.columns]
            for j, peer in enumerate(problems)
        ]
        factor = linalg.cho_factor(own.H)
        rows.append(-linalg.cho_solve(factor, np.concatenate(coupling, axis=1)))
    best, kept = np.concatenate(rows), kept_share(config)
    return best if kept == 0.0 else (1.0 - kept) * best + kept * np.eye(len(best))


def iteration_radius(config: Config, predictor: Predictor) -> float:
    """Spectral radius of the iteration of the agents' plans, the worst stance pattern and phase.

    Below 1 the one-step-delay iteration of the plans converges; 0 for a single robot.
    """
    if predictor.layout.agents == 1:
        return 0.0
    if is_cooperative(config):
        return cooperative_radius(config, predictor)
    return max(
        float(np.abs(linalg.eigvals(best_response_map(config, predictor, step))).max())
        for step in distinct_steps(config, predictor.phases)
    )


def probe_costs(config: Config, predictor: Predictor) -> tuple[float, ...]:
    """Numbers that tell the QPs that a radius belongs to: Σ pᵀ H p and Σ pᵀ G_uᵀ Q̄ q of each step.

    p and q are fixed, so that any key that changes a cost changes them, whatever it is called.
    Two numbers for each distinct planning step, of all agents' own QPs, after one that tells
    cooperative plans from best responses and has their damping; () for a single robot.
    """
    if predictor.layout.agents == 1:
        return ()
    kept = kept_share(config)
    probes = [-kept] if kept else []
    if is_cooperative(config):
        probes = [-1.0 - max(0.0, config.planner.damping)]
    for step in distinct_steps(config, predictor.phases):
        random, hessian, gradient = np.random.default_rng(0), 0.0, 0.0
        for problem in _problems(config, predictor, step):
            p, q = (random.uniform(0.5, 1.5, size) for size in problem.gradient.shape)
            hessian += float(p @ problem.H @ p)
            gradient += float(p @ problem.gradient @ q)
        probes += [hessian, gradient]
    return tuple(probes)


def are_same_costs(probes: tuple[float, ...], others: tuple[float, ...]) -> bool:
    """Whether two results of `probe_costs` are of the same QPs."""
    return len(probes) == len(others) and np.allclose(probes, others, rtol=_SAME, atol=0.0)


def _problems(config: Config, predictor: Predictor, step: int) -> list[PlannerProblem]:
    """Each agent's QP at a planning step, as the planner builds it."""
    phase, problems = phase_of(config, step, predictor.phases), []
    for i in range(predictor.layout.agents):
        G_u, stance = predictor.future_block(i, i, phase), horizon_stance(config, i, step)
        problems.append(build_problem(config.planner, config.robot.weight, G_u, stance))
    return problems
