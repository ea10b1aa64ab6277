"""The figures of merit of one closed-loop trial, from what was seen of the walk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from quadriga.agents.gait import nominal_forces
from quadriga.recordings.falls import find_falls
from quadriga.recordings.stops import find_stops
from quadriga.recordings.summary import steady_from
from quadriga.recordings.traces import (
    ERRORS,
    OVER_STANCE_FEET,
    Traces,
    mean_of,
    plan_times,
    quantile_of,
    stance_height_errors,
    times_of,
    tracking_errors,
)
from quadriga.recordings.truth import distance
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement
from quadriga.shared.robots.conventions import GRAVITY, N_LEGS, OUTPUTS, Array

_SHORTEST: Final = 0.5  # m; over a shorter way a cost of transport is that of starting


@dataclass(frozen=True, slots=True)
class Walk:
    """What was seen of a walk.

    Attributes:
        traces: truth, references, statuses and events.
        samples: what each robot measured, with the forces it applied.
        plans: how many plans had which status, all robots together.
        work: what all motors did or took up, ∑ |τ q̇| dt, J; None of a recording, whose torques and
            rates are those of noisy sensors.
        failed: robots whose controller of one's own failed, and how; that ended the walk.
    """

    traces: Traces
    samples: Mapping[str, tuple[Measurement, ...]]
    plans: Mapping[str, int]
    work: float | None = None
    failed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures of merit; None where the walk was too short for a steady part.

    The steady part is from `quadriga.recordings.summary.steady_from` to the end, or to the first
    fall.

    Attributes:
        seconds: world time of the last sample seen, or of the first fall, s.
        fallen: when each robot that fell did so, s.
        stopped: why each robot that stopped for another reason did so.
        mean: of each output over the steady part, all robots; m, m/s, rad, rad/s.
        rmse: the same, of each of `quadriga.recordings.traces.ERRORS`.
        cost: mean of ‖y − y_des‖²_Q + ‖u − u_nominal‖²_R over samples of 10 ms and robots, where
            the height is that over the stance feet.
        cost_outputs, cost_forces: its two parts.
        planner_ms_median, planner_ms_p99: time of one planning step, without the first of each
            process, ms.
        solves: planning steps, those included.
        plans: how many plans had which status.
        distance: length of the way, mean over the robots, m.
        work: of all motors, ∑ |τ q̇| dt over the whole walk, J.
        cost_of_transport: work over weight (robots and payload) and distance.
    """

    seconds: float
    fallen: Mapping[str, float]
    stopped: Mapping[str, str]
    mean: Mapping[str, float | None]
    rmse: Mapping[str, float | None]
    cost: float | None
    cost_outputs: float | None
    cost_forces: float | None
    planner_ms_median: float | None
    planner_ms_p99: float | None
    solves: int
    plans: Mapping[str, int]
    distance: float | None = None
    work: float | None = None
    cost_of_transport: float | None = None


def compute_figures(walk: Walk) -> Figures:
    """The figures of merit of a walk."""
    traces, truth = walk.traces, walk.traces.truth
    config, falls = traces.config, find_falls(traces)
    planner, fallen = config.planner, {robot: tick / 1000.0 for robot, tick in falls.items()}
    end = min(falls.values()) if falls else int(truth.tick.max(initial=0))
    begin = steady_from(traces)
    y, error = tracking_errors(traces, begin, end)
    squares = {name: mean_of(error[..., i] ** 2) for i, name in enumerate(OUTPUTS)}
    heights = [stance_height_errors(traces, robot, begin, end) for robot in traces.robots]
    squares[OVER_STANCE_FEET] = mean_of(np.concatenate(heights) ** 2)
    outputs = _output_cost(planner.Q, squares)
    forces = mean_of(_force_cost(walk, begin, end, np.tile(planner.R, N_LEGS)))
    every = [status for of_robot in traces.statuses.values() for status in of_robot]
    planner_ms = np.concatenate([plan_times(of_robot) for of_robot in traces.statuses.values()])
    return Figures(
        seconds=end / 1000.0,
        fallen=fallen,
        stopped=_find_stops(walk, fallen),
        mean={name: mean_of(y[..., i]) for i, name in enumerate(OUTPUTS)},
        rmse={name: None if (of := squares[name]) is None else of**0.5 for name in ERRORS},
        cost=None if outputs is None or forces is None else outputs + forces,
        cost_outputs=outputs,
        cost_forces=forces,
        planner_ms_median=quantile_of(planner_ms, 0.5),
        planner_ms_p99=quantile_of(planner_ms, 0.99),
        solves=len(times_of(every, "planner_ms")),
        plans=dict(sorted(walk.plans.items())),
        distance=(way := distance(truth, 2 * config.gait.stance_ms, end if fallen else None)),
        work=walk.work,
        cost_of_transport=_cost_of_transport(config, walk.work, way),
    )


def _cost_of_transport(config: Config, work: float | None, way: float | None) -> float | None:
    if work is None or way is None or way < _SHORTEST:
        return None
    mass = config.team.robots * config.robot.mass + config.world.payload
    return work / (mass * GRAVITY * way)


def _find_stops(walk: Walk, fallen: Mapping[str, float]) -> dict[str, str]:
    stops = find_stops(walk.traces) | dict(walk.failed)
    return {name: reason for name, reason in stops.items() if name not in fallen}


def _output_cost(Q: Sequence[float], squares: Mapping[str, float | None]) -> float | None:
    """∑ q e², with the height over the stance feet: what the planner can do something about."""
    ordered = [squares[OVER_STANCE_FEET], *(squares[name] for name in OUTPUTS[1:])]
    terms = [q * square for q, square in zip(Q, ordered, strict=True) if square is not None]
    return sum(terms) if len(terms) == len(OUTPUTS) else None


def _force_cost(walk: Walk, begin: int, end: int, R: Array) -> Array:
    """‖u − u_nominal‖²_R of every sample of every robot within the steady part."""
    parts, weight = [np.zeros(0)], walk.traces.config.robot.weight
    for samples in walk.samples.values():
        kept = [sample for sample in samples if begin <= sample.tick <= end]
        if kept:
            u = np.array([sample.u for sample in kept])
            stance = np.array([sample.stance for sample in kept]) > 0.5
            parts.append((u - nominal_forces(stance, weight)) ** 2 @ R)
    return np.concatenate(parts)
