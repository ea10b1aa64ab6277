"""The inputs of planners on a real walk: every planning step of every robot, for a benchmark."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import horizon_stance, nominal_forces, step_ms
from quadriga.agents.planner.peers import USABLE, PeerData
from quadriga.agents.planner.planner import PlannerInputs
from quadriga.agents.predictor.episode import commanded_outputs, output_base
from quadriga.agents.predictor.predictor import Predictor
from quadriga.identification.rollout import Rollout
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan, Reference
from quadriga.shared.robots.conventions import Array, robot_names
from quadriga.shared.topics import REFERENCE_EPOCH_MS, SAMPLE_MS
from quadriga.team.operator import reference_at, references_of


@dataclass(frozen=True, slots=True)
class PlanningTick:
    """One planning step k of the whole team, in deviations.

    Attributes:
        stance: scheduled stance over the horizon, (n, N, 4).
        nominal: forces that deviations are counted from, (n, N, 12), N.
        past: own windows [u_ini; y_ini] that end at k, (n, 18 T_ini).
        y_des: desired outputs, (n, 6 N).
        before: windows that end at k−1 and plans of k−1, [u_ini; y_ini; u], (n, 18 T_ini + 12 N).
        inputs: each robot's own data for its planner.
        peers: all robots' data for their peers' planners.
        base_before: base of the outputs of the windows that end at k−1, (T_ini, 6).
    """

    stance: NDArray[np.bool_]
    nominal: Array
    past: Array
    y_des: Array
    before: Array
    inputs: tuple[PlannerInputs, ...]
    peers: tuple[PeerData, ...]
    base_before: Array


def record(config: Config, predictor: Predictor) -> list[PlanningTick]:
    """Walk `config` in this process and record the inputs of every planning step."""
    names = robot_names(config.team.robots)
    samples: dict[str, dict[int, Measurement]] = {name: {} for name in names}
    plans: dict[str, dict[int, Plan]] = {name: {} for name in names}
    rollout = Rollout(config, predictor, references_of(config))
    for tick in rollout.ticks(round(1000 * config.world.duration)):
        for name, out in tick.outputs.items():
            if out.measurement is not None:
                samples[name][out.measurement.tick] = out.measurement
            if out.plan is not None:
                plans[name][out.plan.step] = out.plan
    steps = sorted(set.intersection(*(set(made) for made in plans.values())))
    return [
        _tick(config, [samples[name] for name in names], [plans[name] for name in names], step)
        for step in steps
        if step - 1 in plans[names[0]]
    ]


def _tick(
    config: Config, samples: list[dict[int, Measurement]], plans: list[dict[int, Plan]], step: int
) -> PlanningTick:
    n, N, now = len(samples), config.planner.N, step * step_ms(config)
    stance = np.stack([horizon_stance(config, i, step) for i in range(n)])
    reference = _in_force(config, now)
    y_base = np.tile(output_base(config, reference), (N, 1))
    y_des = np.tile(commanded_outputs(reference), (N, 1))
    inputs = tuple(
        replace(_window(config, own, now), step=step, y_base=y_base, y_des=y_des) for own in samples
    )
    earlier = [_window(config, own, now - step_ms(config)) for own in samples]
    peers = []
    for j, window in enumerate(earlier):
        nominal = nominal_forces(horizon_stance(config, j, step - 1), config.robot.weight)
        peers.append(
            PeerData(
                robot=f"r{j + 1}",
                index=j,
                status=USABLE,
                step=step - 1,
                age=0,
                known=np.ones(config.planner.T_ini, dtype=np.bool_),
                du_ini=window.u_ini - nominal_forces(window.stance_ini, config.robot.weight),
                y_ini=window.y_ini,
                du=plans[j][step - 1].u - nominal,
            )
        )
    before = [
        np.concatenate([window.past(), peer.du.ravel()])
        for window, peer in zip(earlier, peers, strict=True)
    ]
    return PlanningTick(
        stance=stance,
        nominal=nominal_forces(stance, config.robot.weight),
        past=np.stack([robot.past() for robot in inputs]),
        y_des=np.tile((y_des - y_base).ravel(), (n, 1)),
        before=np.stack(before),
        inputs=inputs,
        peers=tuple(peers),
        base_before=earlier[0].y_base_ini,
    )


def _window(config: Config, samples: dict[int, Measurement], end: int) -> PlannerInputs:
    """The T_ini samples that end at tick `end`; the horizon is filled in by the caller."""
    ticks = range(end - SAMPLE_MS * (config.planner.T_ini - 1), end + 1, SAMPLE_MS)
    window = [samples[tick] for tick in ticks]
    base = [output_base(config, _in_force(config, tick)) for tick in ticks]
    return PlannerInputs(
        step=0,
        u_ini=np.array([sample.u for sample in window]),
        y_ini=np.array([sample.y for sample in window]),
        stance_ini=np.array([sample.stance for sample in window]) > 0.5,
        y_base_ini=np.array(base),
        y_base=np.array(base),
        y_des=np.array(base),
        weight=config.robot.weight,
    )


def _in_force(config: Config, tick: int) -> Reference:
    return reference_at(config, tick // REFERENCE_EPOCH_MS * REFERENCE_EPOCH_MS)
