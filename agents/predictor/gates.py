"""Figures that a predictor must reach before a team may walk with it, and their limits.

Held-out error, height gain and effect of peers are measured here, with data that the fit has not
seen. The radius of the iteration of plans is one of the planner's QPs: `agents/planner/acceptance`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import linalg
from scipy.special import stdtrit

from quadriga.agents.predictor.episode import Y_SCALE, Episode
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.regression import scaled_blocks
from quadriga.agents.time_grid import gait_phase, horizon_stance, phase_of, walking_steps
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import PredictorError
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import N_LEGS, N_OUTPUTS, OUTPUTS, Array
from quadriga.shared.topics import SAMPLE_MS

LEFT_OUT: Final = 0.02  # of the effect of own forces: a smaller effect of peers is as good as none
UNDERSTATED: Final = 1.25  # slope above which the effect is certainly too small
MATERIAL: Final = 0.02  # of the squared error: a smaller harm is not worth a word
GAIN_TIMES: Final = (0.1, 0.25)  # s
_GAIN_FORCE: Final = 10.0  # N, on the robot looked at
_BLOCK: Final = 100  # windows: 1 s, longer than a window's errors are alike
_TAIL: Final = 0.975  # of the two-sided interval


class Bounds(NamedTuple):
    """An estimate with its 95 % interval; None where the data do not tell."""

    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class PeersFigures:
    """The predicted effect of the peers' forces by output, in held-out windows of all robots.

    With p the part of a prediction that is due to the peers' forces within the horizon, and r what
    is measured less all other parts of the prediction. The forces of the data are random and
    independent of each other, so p explains as much of r as the peers really do.

    Attributes:
        share: norm of p for one peer over that of the part due to the robot's own forces.
        slope: Σ p r / Σ p²: 1 if the peers do what is predicted, 0 if p is invented, more than 1 if
            p is too small. Below 0.5 predictions are better without p.
        harm: (‖r − p‖² − ‖r‖²) / ‖r‖²: how much p raises the squared error; negative if it helps.
        harm_limit: a predictor whose harm is certainly above this is refused.
    """

    share: Mapping[str, float | None]
    slope: Mapping[str, Bounds]
    harm: Mapping[str, Bounds]
    harm_limit: float

    @classmethod
    def from_dict(cls, body: Mapping[str, Any]) -> PeersFigures:
        """The inverse of `asdict`, also after JSON has made lists of tuples.

        Raises:
            TypeError, KeyError: fields are missing or unknown.
        """
        bounds = {
            name: {output: Bounds(*values) for output, values in body[name].items()}
            for name in ("slope", "harm")
        }
        return cls(**{**body, **bounds})

    def check(self) -> None:
        """Refuse a predictor whose agents would respond to effects that are certainly not there.

        Raises:
            PredictorError: the effect of peers raises the error of an output beyond the limit.
        """
        for output, harm in self.harm.items():
            if harm.value is None or harm.low is None or not harm.low > self.harm_limit:
                continue
            raise PredictorError(
                f"predictor: effect of peers on {output}",
                f"{100 * harm.value:.0f} % more squared error on held-out data than without it",
                f"certainly at most {100 * self.harm_limit:g} %",
                "invented from noise: more data, or a larger identification.block_weight",
            )

    def verdict(self, output: str) -> str:
        """What the data say of the peers' effect on an output, in a word or two."""
        share, slope, harm = self.share[output], self.slope[output], self.harm[output]
        if harm.low is not None and harm.low > 0.0 and (harm.value or 0.0) > MATERIAL:
            return "invented"
        if share is None or share < LEFT_OUT:
            return "left out"
        if slope.low is not None and slope.low > UNDERSTATED:
            return "understated"
        if harm.high is not None and harm.high < 0.0:
            return "confirmed"
        return "unclear"

    def outputs_with(self, verdict: str) -> tuple[str, ...]:
        """The outputs of which the data say this."""
        return tuple(output for output in self.share if self.verdict(output) == verdict)

    def describe(self) -> str:
        """All that is wrong with the effect of the peers, in one line; "" if nothing is."""
        found = {word: self.outputs_with(word) for word in ("invented", "understated", "left out")}
        return "; ".join(f"{word}: {', '.join(names)}" for word, names in found.items() if names)


@dataclass(frozen=True, slots=True)
class GateReport:
    """Figures of a predictor and the limits they are compared with; stored in its file.

    Attributes:
        windows: held-out windows predicted.
        rmse: held-out error per output over the horizon, all robots [m, m/s, rad, rad/s].
        rmse_persistence: the same for holding the last measured output.
        error: scaled error of all outputs together over that of persistence; must be < 1.
        gain_times: times after the step of force at which the height response is compared [s].
        gains: predicted over physical height response, per robot and time, of the worst phase.
        gain_limits: every gain must lie between these.
        radius: spectral radius of the iteration of the agents' plans, the worst of all stance
            patterns and phases.
        radius_limit: must be below this.
        Q, R: planner weights that the radius was computed for.
        condition: number of the regression, penalty included; None if it is not known.
        coupling: norm of the scaled G_ij, the largest of all phases, per robot i and j.
        size: of G, bytes.
        cost_probes: tell the QPs that the radius was computed for.
        cost: that the agents minimise: "own", then the plans are best responses; "team".
        peers: what it says of the effect of peers' forces, against held-out data; None of a single
            robot.
    """

    windows: int
    rmse: dict[str, float]
    rmse_persistence: dict[str, float]
    error: float
    gain_times: tuple[float, ...]
    gains: tuple[tuple[float, ...], ...]
    gain_limits: tuple[float, ...]
    radius: float
    radius_limit: float
    Q: tuple[float, ...]
    R: tuple[float, ...]
    condition: float | None = None
    coupling: tuple[tuple[float, ...], ...] = ()
    size: int = 0
    cost_probes: tuple[float, ...] = ()
    cost: str = "own"
    peers: PeersFigures | None = None

    @property
    def iteration(self) -> str:
        """What is iterated, in words."""
        return "best-response" if self.cost == "own" else "cooperative"

    def to_dict(self) -> dict[str, Any]:
        """A dictionary that can be written as JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, body: dict[str, Any]) -> GateReport:
        """The inverse of `to_dict`, also after JSON has made lists of tuples.

        Raises:
            TypeError, KeyError: fields are missing or unknown.
        """
        frozen: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in body.items()
        }
        for table in ("gains", "coupling"):
            frozen[table] = tuple(tuple(row) for row in frozen[table])
        if frozen["peers"] is not None:
            frozen["peers"] = PeersFigures.from_dict(frozen["peers"])
        return cls(**frozen)

    def check(self, kind: str = "distributed") -> None:
        """Refuse the predictor if a figure is beyond its limit.

        Args:
            kind: of planner that will use it; the radius and the effect of peers matter only if
                its agents respond to each other's plans.

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
        low, high = self.gain_limits
        for robot, row in enumerate(self.gains, start=1):
            for time, gain in zip(self.gain_times, row, strict=True):
                if not low <= gain <= high:
                    raise PredictorError(
                        f"predictor: height gain of r{robot} at {time:g} s",
                        f"{gain:.2f}",
                        f"{low:g} … {high:g} of the physical response",
                        "forces in the data that follow the outputs (feedback bias), "
                        "or a controller stiffer than the interface assumes",
                    )
        if not find_kind(kind).needs_peers:
            return
        if not self.radius < self.radius_limit:
            raise PredictorError(
                f"predictor: radius of the {self.iteration} map",
                f"{self.radius:.3f}",
                f"below {self.radius_limit:g}",
                "the agents' plans would diverge; "
                + (
                    "damp them by planner.damping, plan with planner.cost = 'team', or, of a ridge "
                    "fit, raise identification.block_weight"
                    if self.cost == "own"
                    else "leave planner.damping at 0, which chooses it"
                ),
            )
        if self.peers is not None:
            self.peers.check()


# ---- held-out error


def window_phases(predictor: Predictor, episode: Episode, windows: int) -> NDArray[np.int64]:
    """The predictor's phase at the end of each window's past. Shape (windows,)."""
    meta = predictor.meta
    ends = episode.first_tick + SAMPLE_MS * (meta.T_ini - 1 + np.arange(windows))
    phases = [gait_phase(int(t), meta.stand_ms, meta.stance_ms, predictor.phases) for t in ends]
    return np.array(phases, dtype=np.int64)


def predict_windows(predictor: Predictor, phases: NDArray[np.int64], z: Array) -> Array:
    """Predicted output deviations of windows of `Episode.windows`, each by the G of its phase.

    Args:
        predictor: of the team.
        phases: of each window, shape (C,).
        z: per robot [u_ini; y_ini; u], shape (n, 18 T_ini + 12 N, C).

    Returns:
        Shape (n, 6 N, C).
    """
    meta = predictor.meta
    y = np.empty((meta.robots, N_OUTPUTS * meta.N, z.shape[2]))
    for phase in np.unique(phases):
        now = phases == phase
        y[:, :, now] = predictor.predict(z[:, :, now], int(phase))
    return y


def squared_errors(predictor: Predictor, held_out: Sequence[Episode]) -> tuple[int, Array, Array]:
    """Mean squared errors of the windows of all held-out episodes and robots.

    Persistence holds the last measured output y, not its deviation.

    Returns:
        The number of windows; the errors of the predictor and of persistence, by sample of the
        horizon and output, shape (N, 6) each.

    Raises:
        PredictorError: no held-out episode is long enough for a window.
    """
    T_ini, N, n = predictor.meta.T_ini, predictor.meta.N, predictor.meta.robots
    squares, naive, count = np.zeros((N, N_OUTPUTS)), np.zeros((N, N_OUTPUTS)), 0
    for episode in held_out:
        if episode.samples < T_ini + N:
            continue
        z, dy = episode.windows(T_ini, N)
        windows = z.shape[2]
        error = predict_windows(predictor, window_phases(predictor, episode, windows), z) - dy
        squares += (error.reshape(n, N, N_OUTPUTS, windows) ** 2).sum(axis=(0, 3))
        future = sliding_window_view(episode.y[T_ini:], N, axis=0)  # (C, n, 6, N)
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
    """Number of windows, RMSE per output, RMSE of persistence, and the ratio of scaled errors."""
    count, squares, naive = squared_errors(predictor, held_out)
    rmse, persistence = np.sqrt(squares.mean(axis=0)), np.sqrt(naive.mean(axis=0))
    ratio = np.linalg.norm(rmse / Y_SCALE) / np.linalg.norm(persistence / Y_SCALE)
    return count, rmse.tolist(), persistence.tolist(), float(ratio)


# ---- height gain and coupling


def height_gains(config: Config, predictor: Predictor) -> Array:
    """Predicted over physical height response to a vertical force on one robot's stance feet.

    Each gain is averaged over the stance patterns of a phase; among the phases the one farthest
    from 1 counts. Shape (n, 2): robot, time of `GAIN_TIMES`.
    """
    N, n = predictor.meta.N, predictor.meta.robots
    physical = physical_height(config, predictor.meta.interface, N)
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
            gains[k, robot] = dy.reshape(N, N_OUTPUTS)[rows, 0] / physical[rows]
    worst = np.abs(gains - 1.0).argmax(axis=0)
    greatest: Array = np.take_along_axis(gains, worst[None], axis=0)[0]
    return greatest


def physical_height(config: Config, interface: str, N: int) -> Array:
    """Height response to the test force at the ends of N samples. Shape (N,), m.

    The low level closes its loop on the height, a = −kp z − kd z' − ki ∫z. "feedforward" adds
    the force to it, z'' = F/m + a. With "force" the whole-body QP weighs the force it is asked
    for against a: on two stance legs γ₂/2·|f − f_des|² + γ₃/2·(z'' − a)² is least at
    z'' = α F/m + (1 − α) a with α = 1/(1 + 2 γ₃/(γ₂ m²)).
    """
    controller, mass = config.controller, config.robot.mass
    passed, share = 1.0, 1.0
    if interface == "force":
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
    robots, layout = range(predictor.meta.robots), predictor.meta.layout
    norms = [
        [
            [np.linalg.norm(scaled_blocks(predictor.block(i, j, phase), layout)) for j in robots]
            for i in robots
        ]
        for phase in range(predictor.phases)
    ]
    table: Array = np.max(norms, axis=0)
    return table


# ---- effect of peers


def peers_figures(
    predictor: Predictor, held_out: Sequence[Episode], harm_limit: float
) -> PeersFigures | None:
    """Figures of the predicted effect of the peers' forces; None for a single robot.

    No walk is needed twice, so data of real robots will do.

    Args:
        predictor: whose predictions they are of.
        held_out: episodes whose forces have random parts, independent between robots.
        harm_limit: stored with the figures.
    """
    n = predictor.meta.robots
    if n == 1:
        return None
    blocks = np.concatenate([_block_sums(predictor, episode) for episode in held_out])
    pp, pr, rr, own = np.moveaxis(blocks, 1, 0)  # each of shape (blocks, 6)
    alone = (n - 1) * own.sum(axis=0)
    nothing = np.full(N_OUTPUTS, np.nan)
    share = np.sqrt(np.divide(pp.sum(axis=0), alone, out=nothing, where=alone > 0.0)).tolist()
    return PeersFigures(
        {name: s if np.isfinite(s) else None for name, s in zip(OUTPUTS, share, strict=True)},
        dict(zip(OUTPUTS, _ratios(pr, pp), strict=True)),
        dict(zip(OUTPUTS, _ratios(pp - 2.0 * pr, rr), strict=True)),
        harm_limit,
    )


def _block_sums(predictor: Predictor, episode: Episode) -> Array:
    """Σ p², Σ p r, Σ r² and Σ (own part)² over each block of windows. Shape (blocks, 4, 6)."""
    meta = predictor.meta
    if episode.samples < meta.T_ini + meta.N:
        return np.zeros((0, 4, N_OUTPUTS))
    z, dy = episode.windows(meta.T_ini, meta.N)
    phases = window_phases(predictor, episode, z.shape[2])
    own, peers = _parts(predictor, phases, z[:, meta.past :])
    rest = dy - predict_windows(predictor, phases, z) + peers
    products = (peers**2, peers * rest, rest**2, own**2)
    by_window = np.array(
        [x.reshape(meta.robots, meta.N, N_OUTPUTS, -1).sum(axis=(0, 1)) for x in products]
    )
    count = max(1, round(z.shape[2] / _BLOCK))
    return np.array([part.sum(axis=2) for part in np.array_split(by_window, count, axis=2)])


def _parts(predictor: Predictor, phases: NDArray[np.int64], u: Array) -> tuple[Array, Array]:
    """Parts of predictions due to a robot's own forces and to its peers', (n, 6 N, C) each.

    Args:
        predictor: of the team.
        phases: of each window, shape (C,).
        u: forces of the horizon, shape (n, 12 N, C).
    """
    n, _, windows = u.shape
    own = np.zeros((n, N_OUTPUTS * predictor.meta.N, windows))
    peers = np.zeros_like(own)
    for phase in np.unique(phases):
        now = phases == phase
        for i in range(n):
            for j in range(n):
                part = predictor.future_block(i, j, int(phase)) @ u[j][:, now]
                (own if i == j else peers)[i][:, now] += part
    return own, peers


def _ratios(over: Array, under: Array) -> list[Bounds]:
    """Σ over / Σ under of each output, its interval from how much the blocks differ.

    The delta method for a ratio of sums over blocks, with Student's t (Cochran, Sampling
    Techniques, 3rd ed., section 6.3).

    Args:
        over: shape (blocks, 6).
        under: likewise, not negative.
    """
    count, total = len(over), under.sum(axis=0)
    bounds = []
    for k in range(N_OUTPUTS):
        if not total[k] > 0.0:
            bounds.append(Bounds(None, None, None))
            continue
        ratio = float(over[:, k].sum() / total[k])
        if count < 2:
            bounds.append(Bounds(ratio, None, None))
            continue
        spread = ((over[:, k] - ratio * under[:, k]) ** 2).sum() * count / (count - 1)
        reach = float(stdtrit(count - 1, _TAIL) * np.sqrt(spread) / total[k])
        bounds.append(Bounds(ratio, ratio - reach, ratio + reach))
    return bounds
