"""Which predictors a team may walk with: four figures, their limits, and the files that pass.

Held-out error, height gain and effect of peers are measured with data that the fit has not seen.
The radius of the iteration of plans is one of the planner's own QPs.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import linalg
from scipy.special import stdtrit

from quadriga.agents.gait import distinct_steps, horizon_stance, phase_of, walking_steps
from quadriga.agents.planner.cooperation import cooperative_radius, is_cooperative, kept_share
from quadriga.agents.planner.qp import build_problem
from quadriga.agents.predictor.episode import Episode
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta, as_tuples
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
    """Figures of a predictor, stored in its file; `info --check` holds them against their limits.

    Attributes:
        error: scaled held-out error of all outputs together over that of persistence.
        gains: predicted over physical height response, per robot and time of `GAIN_TIMES`, of the
            worst phase.
        radius: spectral radius of the iteration of the agents' plans, the worst of all stance
            patterns and phases.
        planner: digest of the planner's keys that the radius is of, see `digest_planner`.
        harm: by output, how much the predicted effect of the peers' forces raises the squared
            error, see `peers_harm`.
    """

    error: float
    gains: tuple[tuple[float, ...], ...]
    radius: float
    planner: str = ""
    harm: Mapping[str, Bounds] = field(default_factory=dict)

    def check(self, config: Config) -> None:
        """Refuse the predictor if a figure is beyond its limit.

        The radius and the effect of peers matter only if the agents respond to each other's plans.

        Raises:
            PredictorError: a figure is beyond its limit; the message names both.
        """

        def require(is_within: bool, name: str, got: str, expected: str, cause: str) -> None:
            if not is_within:
                raise PredictorError(f"predictor: {name}", got, expected, cause)

        cause = "too little data, or a plant that the data do not show; collect more"
        got = f"{self.error:.3f} of persistence"
        require(self.error < 1.0, "held-out error", got, "below 1", cause)
        limits = config.identification
        low, high = limits.gain_range
        expected = f"{low:g} … {high:g} of the physical response"
        cause = (
            "forces in the data that follow the outputs (feedback bias), or a controller stiffer "
            "than the interface assumes"
        )
        for robot, row in enumerate(self.gains, start=1):
            for time, gain in zip(GAIN_TIMES, row, strict=True):
                name = f"height gain of r{robot} at {time:g} s"
                require(low <= gain <= high, name, f"{gain:.2f}", expected, cause)
        if not find_kind(config.planner.kind).needs_peers:
            return
        kind, remedy = "cooperative", "leave planner.damping at 0, which chooses it"
        if not is_cooperative(config):
            kind, remedy = "best-response", "damp them by planner.damping, plan with planner.cost "
            remedy += "= 'team', or, of a ridge fit, raise identification.block_weight"
        limit, cause = radius_limit(config), f"the agents' plans would diverge; {remedy}"
        name, got = f"radius of the {kind} map", f"{self.radius:.3f}"
        require(self.radius < limit, name, got, f"below {limit:g}", cause)
        expected = f"certainly at most {100 * limits.max_peers_harm:g} %"
        cause = "invented from noise: more data, or a larger identification.block_weight"
        for output, harm in self.harm.items():
            got = f"{100 * harm.value:.0f} % more squared error on held-out data than without it"
            within = not harm.low > limits.max_peers_harm
            require(within, f"effect of peers on {output}", got, expected, cause)


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
        given = body["gates"]
        names = {each.name for each in fields(GateReport)} & given.keys()
        known = {name: as_tuples(given[name]) for name in names}
        known["harm"] = {name: Bounds(*three) for name, three in given.get("harm", {}).items()}
        whole = {name: as_tuples(value) for name, value in body.items()}
        return cls(**whole | {"gates": GateReport(**known)})


def radius_limit(config: Config) -> float:
    """What the radius of the iteration of plans must be below.

    Cooperative plans converge wherever it is below 1, bounds or not. Of best responses none knows
    where bounds are active, hence the margin `identification.max_radius`.
    """
    return 1.0 if is_cooperative(config) else config.identification.max_radius


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

    The figures are compared with the limits of `config`, see `gates_in_force`.

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
    """The figures that are stored with a predictor, with the radius of the plans of `config`.

    It is computed again only if the agents respond to each other's plans, and any key of their
    planner is another one than when it was stored.
    """
    digest = digest_planner(config)
    if digest == gates.planner or not find_kind(config.planner.kind).needs_peers:
        return gates
    return replace(gates, radius=iteration_radius(config, predictor), planner=digest)


def digest_planner(config: Config) -> str:
    """Digest of all keys of the planner; 16 hexadecimal digits."""
    return hashlib.sha256(repr(config.planner).encode()).hexdigest()[:16]


def run_gates(config: Config, predictor: Predictor, held_out: Sequence[Episode]) -> GateReport:
    """Measure the figures of a predictor on episodes that its fit has not seen.

    Raises:
        PredictorError: no held-out episode is long enough.
    """
    return GateReport(
        error=held_out_error(predictor, held_out)[-1],
        gains=tuple(tuple(row) for row in height_gains(config, predictor).tolist()),
        radius=iteration_radius(config, predictor),
        planner=digest_planner(config),
        harm=peers_harm(predictor, held_out),
    )


# ---- held-out error


def held_out_error(predictor: Predictor, held_out: Sequence[Episode]) -> tuple[Array, Array, float]:
    """Errors of the windows of all held-out episodes and agents, of any plant.

    Persistence holds the last measured output y, not its deviation.

    Returns:
        RMSE of the predictor and of persistence, by sample of the horizon and output, (N, p) each;
        the ratio of all of them, scaled: below 1 the predictor is of use.

    Raises:
        PredictorError: no held-out episode is long enough for a window.
    """
    layout = predictor.layout
    T_ini, N, n, p = layout.T_ini, layout.N, layout.agents, layout.outputs
    squares, count = np.zeros((2, N, p)), 0  # of the predictor and of persistence
    for episode, error, _ in _predict_windows(predictor, held_out):
        windows = error.shape[2]
        future = sliding_window_view(episode.y[T_ini:], N, axis=0)  # (C, n, p, N)
        last = episode.y[T_ini - 1 : T_ini - 1 + windows, ..., None]
        squares[0] += (error.reshape(n, N, p, windows) ** 2).sum(axis=(0, 3))
        squares[1] += ((future - last) ** 2).sum(axis=(0, 1)).T
        count += windows
    if count == 0:
        expected, cause = f"at least {T_ini + N} samples", "did every held-out walk end in a fall?"
        raise PredictorError("held-out data", "no episode that long", expected, cause)
    rmse, persistence = np.sqrt(squares / (count * n))
    ours, theirs = (np.linalg.norm(each / np.array(layout.y_scale)) for each in (rmse, persistence))
    return rmse, persistence, float(ours / theirs)


def _predict_windows(
    predictor: Predictor, episodes: Sequence[Episode]
) -> Iterator[tuple[Episode, Array, Array]]:
    """Predict every window of the episodes that are long enough by the G of its phase.

    Yields:
        The episode; by window, predicted less measured output deviations, and the part of the
        prediction that is due to the peers' inputs of the horizon, (n, p N, C) each.
    """
    layout, period = predictor.layout, predictor.meta.period
    agents = range(layout.agents)
    for episode in episodes:
        if episode.samples < layout.T_ini + layout.N:
            continue
        z, dy = episode.windows(layout.T_ini, layout.N)
        ends = layout.T_ini - 1 + np.arange(z.shape[2])
        since = episode.first_tick + period.sample * ends - period.begin
        phases = since % period.ticks * predictor.phases // period.ticks
        error, peers = -dy, np.zeros_like(dy)
        for phase in np.unique(phases).tolist():
            now = phases == phase
            error[:, :, now] += predictor.predict(z[:, :, now], phase)
            for i, j in ((i, j) for i in agents for j in agents if i != j):
                u = z[j, layout.past :][:, now]
                peers[i][:, now] += predictor.future_block(i, j, phase) @ u
        yield episode, error, peers


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
    by_phase = defaultdict[int, list[int]](list)
    for step in walking_steps(config):
        by_phase[phase_of(config, step, predictor.phases)].append(step)
    gains = np.empty((len(by_phase), n, len(rows)))
    for (k, (phase, steps)), robot in product(enumerate(by_phase.items()), range(n)):
        patterns = np.array([horizon_stance(config, robot, step) for step in steps])
        du = np.zeros((N, N_LEGS, 3))
        du[:, :, 2] = _GAIN_FORCE * (patterns / patterns.sum(axis=2, keepdims=True)).mean(axis=0)
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
    passed = share = 1.0
    if config.planner.interface == "force":
        passed = 1.0 / (1.0 + 2.0 * controller.gamma_defect / (controller.gamma_force * mass**2))
        share = 1.0 - passed
    A = np.zeros((4, 4))  # ∫z, z, z', 1
    A[0, 1] = A[1, 2] = 1.0
    A[2, 3] = passed * _GAIN_FORCE / mass
    A[2, :3] = -share * np.array([controller.ki_z, controller.kp_z, controller.kd_z])
    step, state, z = linalg.expm(A * SAMPLE_MS / 1000.0), np.array([0.0, 0.0, 0.0, 1.0]), []
    for _ in range(N):
        state = step @ state
        z.append(state[1])
    return np.array(z)


def coupling_table(predictor: Predictor) -> Array:
    """Frobenius norms of the blocks G_ij of the scaled predictor, largest phase. Shape (n, n)."""
    n, (z_scale, y_scale) = predictor.layout.agents, predictor.layout.scales()
    table = np.zeros((n, n))
    for phase, i, j in product(range(predictor.phases), range(n), range(n)):
        scaled = predictor.block(i, j, phase) * z_scale / y_scale[:, None]
        table[i, j] = max(table[i, j], np.linalg.norm(scaled))
    return table


# ---- effect of peers


def peers_harm(predictor: Predictor, held_out: Sequence[Episode]) -> dict[str, Bounds]:
    """How much the predicted effect of the peers' forces raises the squared error, by output.

    That is (‖r − p‖² − ‖r‖²) / ‖r‖², where p is the part of a prediction that is due to the peers'
    forces within the horizon, and r what is measured less all other parts; negative if p helps.
    Forces in the data are random and independent between robots, so that no walk is needed twice,
    and data of real robots will do. Sums over blocks of windows; the interval is that of the delta
    method for a ratio of such sums, with Student's t (Cochran, Sampling Techniques, 3rd ed.,
    section 6.3). Empty of a single robot, and of less than 1.5 s held out, which tell no interval.
    """
    layout, blocks = predictor.layout, []
    if layout.agents == 1:
        return {}
    for _, error, peers in _predict_windows(predictor, held_out):
        squares = np.array([error**2, (error - peers) ** 2])
        by_window = squares.reshape(2, layout.agents, layout.N, layout.outputs, -1).sum(axis=(1, 2))
        count = max(1, round(error.shape[2] / _BLOCK))
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


# ---- whether the iteration of the agents' plans converges


def best_response_map(config: Config, predictor: Predictor, step: int) -> Array:
    """The linear map from all agents' present plans to their next, without inequality constraints.

    U_i ← −(1 − d) H_ii⁻¹ G_iiᵀ Q̄ Σ_{j≠i} G_ij U_j + d U_i over the stance legs of planning step
    `step`, with the G of its phase and the damping d. H_ii is that of the QP that is solved.
    Shape (s, s), s being the number of stance forces of the team (150 per robot at N = 25).
    """
    phase, rows = phase_of(config, step, predictor.phases), []
    problems = [
        build_problem(
            config.planner,
            config.robot.weight,
            predictor.future_block(i, i, phase),
            horizon_stance(config, i, step),
        )
        for i in range(predictor.layout.agents)
    ]
    for i, own in enumerate(problems):
        coupling = [
            (i != j) * (own.gradient @ predictor.future_block(i, j, phase)[:, peer.columns])
            for j, peer in enumerate(problems)
        ]
        rows.append(-linalg.cho_solve(linalg.cho_factor(own.H), np.concatenate(coupling, axis=1)))
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
