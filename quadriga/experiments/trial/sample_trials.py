"""Short trials of everything a walk can meet: what published figures depend on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from quadriga.agents.planner.team import TeamPlanner
from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.experiments.trial.figures_of_merit import Figures, compute_figures
from quadriga.experiments.trial.in_process import build_timed_agents, roll_out
from quadriga.identification.behaviour import numbers
from quadriga.identification.central_planner import choose_central_planner
from quadriga.identification.rollout import Tick
from quadriga.identification.sample_fits import linear_episode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.planner_kinds import find_kind
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array

# Full speed from 0.2 s on, so that 1.4 s have a steady part of 0.2 s.
_KEYS: Final = {
    "world.seed": 3, "world.duration": 1.4, "world.scatter": 0.02, "gait.stand_ms": 100,
    "reference.ramp": 0.1, "reference.vx": 0.5, "reference.wz": 0.2, "planner.N": 10,
    "planner.T_ini": 4,
}  # fmt: skip
_NONE: Final = {"planner.kind": "none"}
_SHORT: Final = {"world.duration": 0.8}
_TRIALS: Final[tuple[dict[str, Any], ...]] = (
    _NONE | {
        "team.robots": 3, "team.yokes": "ring", "world.terrain": "boxes",
        "world.terrain_height": 0.1, "world.payload": 6.0, "world.payload_on": "r1:2,r3:1",
        "world.payload_scatter": 0.05, "world.push_force": 200.0, "world.push_every": 0.4,
        "world.push_spread": 0.2,
    },
    _NONE | {
        "team.robots": 2, "world.terrain": "slope", "world.slope": 10.0, "world.friction": 0.35,
        "world.motor_strength": "r1:FL_calf:0.3,any:any:0.5:0.6",
    },
    _NONE | _SHORT | {"team.robots": 1, "world.terrain": "pebbles", "world.terrain_height": 0.02},
    _NONE | _SHORT | {"team.robots": 1, "world.terrain": "gravel", "controller.preset": "plain"},
    _NONE | _SHORT | {
        "team.robots": 1, "world.terrain": "heightfield", "estimator.kind": "truth",
        "controller.preset": "soft",
    },
    # One that falls: a push no robot stands.
    _NONE | {"team.robots": 2, "world.push": "r2:900:90:0.3:0.4", "gait.stance_ms": 150},
    {"team.robots": 3, "planner.kind": "distributed", "world.push": "all:80:45:0.3:0.2"},
    {
        "team.robots": 2, "planner.kind": "distributed", "planner.compensation": True,
        "planner.damping": 0.3, "planner.exchanges": 1,
    },
    {
        "team.robots": 2, "planner.kind": "decentralised", "planner.preset": "fast",
        "world.payload": 4.0,
        "planner.output_bounds": "hard", "planner.output_max": (1.0,) * 6,
    },
    _SHORT | {
        "team.robots": 2, "planner.kind": "distributed", "planner.interface": "force",
        "planner.solver": "osqp", "controller.preset": "plain",
    },
    _SHORT | {
        "team.robots": 3, "planner.kind": "distributed", "planner.cost": "team",
        "planner.exchanges": 1,
    },
    _SHORT | {"team.robots": 2, "planner.kind": "centralised"},
    _SHORT | {"team.robots": 2, "planner.kind": "deepc"},
)  # fmt: skip


def samples() -> Iterator[Array]:
    """All that robots sent and sensed in each trial, and the trial's figures."""
    for keys in _TRIALS:
        config = load(None, _KEYS | keys)
        seen: list[Array] = []

        def watch(tick: Tick, seen: list[Array] = seen) -> None:
            seen.extend(numbers_sent(tick))

        needs_one = find_kind(config.planner.kind).needs_predictor
        predictor = sample_predictor(config) if needs_one else None
        walk = roll_out(
            config, build_timed_agents(config, predictor), _team_planner(config, predictor), watch
        )
        yield from seen
        truth = walk.traces.truth
        yield from (truth.base_pos, truth.base_quat_wxyz, truth.grf, truth.yoke_force)
        yield from of_figures(compute_figures(walk))


def numbers_sent(tick: Tick) -> Iterator[Array]:
    """The numbers of what agents sent at a tick, and how many events there were."""
    for out in tick.outputs.values():
        yield out.command.row
        if (sample := out.measurement) is not None:
            yield from (sample.u, sample.y, sample.stance)
        if (plan := out.plan) is not None:
            yield from (plan.u, plan.y)
    yield numbers(len(tick.events))


def of_figures(figures: Figures) -> Iterator[Array]:
    """Figures of merit but for those of wall time."""
    yield numbers(figures.seconds, figures.cost, figures.cost_outputs, figures.cost_forces)
    yield numbers(figures.distance, figures.work, figures.cost_of_transport, len(figures.stopped))
    yield numbers(*figures.fallen.values())
    yield numbers(*figures.mean.values(), *figures.rmse.values())
    yield numbers(*sorted(figures.plans.values()))


def sample_predictor(config: Config) -> Predictor:
    """One that is not fitted: outputs stay as they are, and forces have small effects at random."""
    meta = PredictorMeta.of(config)
    n, N = meta.robots, meta.N
    random = np.random.default_rng(11)
    per_column = np.concatenate(
        [
            np.full(N_FORCES * meta.T_ini, 1.0 / U_SCALE),
            np.tile(1.0 / Y_SCALE, meta.T_ini),
            np.full(N_FORCES * N, 1.0 / U_SCALE),
        ]
    )
    G = 0.01 * random.normal(size=(meta.phases, n, n, N_OUTPUTS * N, meta.layout.width))
    G *= np.tile(Y_SCALE, N)[:, None] * per_column
    last = meta.layout.past - N_OUTPUTS
    for i in range(n):
        G[:, i, i, :, last : meta.layout.past] += np.tile(np.eye(N_OUTPUTS), (N, 1))
    return Predictor(meta, G)


def _team_planner(config: Config, predictor: Predictor | None) -> TeamPlanner | None:
    if not find_kind(config.planner.kind).central:
        return None
    return choose_central_planner(
        config, predictor, lambda: [linear_episode(config, 300, seed) for seed in range(2)]
    )
