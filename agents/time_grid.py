"""The planner's time grid: samples, planning steps, and the stance pattern of a horizon."""

from __future__ import annotations

from math import lcm

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import scheduled_stance
from quadriga.shared.config.sections import Config
from quadriga.shared.topics import SAMPLE_MS


def step_ms(config: Config) -> int:
    """World time between two plans: the applied samples of each."""
    return SAMPLE_MS * config.planner.applied


def exchange_ms(config: Config) -> int:
    """World time from a planning step to its first exchange, and between two of them.

    Peers' last answers are taken in after as much time again, which leaves the rest of the step
    for their terms, off the critical path.
    """
    return step_ms(config) // (config.planner.exchanges + 2)


def sample_starts(tick: int, count: int) -> NDArray[np.int64]:
    """Ticks at which `count` samples from `tick` on begin; sample k covers [t_k, t_k + 10 ms]."""
    return tick + SAMPLE_MS * np.arange(count, dtype=np.int64)


def horizon_stance(config: Config, index: int, step: int) -> NDArray[np.bool_]:
    """Scheduled stance of robot `index` at the N samples of planning step `step`. Shape (N, 4)."""
    ticks = sample_starts(step * step_ms(config), config.planner.N)
    return scheduled_stance(config, index, ticks)


def walking_steps(config: Config) -> range:
    """Planning steps after the initial stand until the gait and the plans line up again."""
    first = -(-config.gait.stand_ms // step_ms(config))
    return range(first, first + lcm(2 * config.gait.stance_ms, step_ms(config)) // step_ms(config))


def distinct_steps(config: Config, phases: int) -> tuple[int, ...]:
    """One planning step for each pair of a phase and the stance patterns of all robots."""
    distinct: dict[tuple[int, bytes], int] = {}
    for step in walking_steps(config):
        robots = range(config.team.robots)
        patterns = b"".join(horizon_stance(config, i, step).tobytes() for i in robots)
        distinct.setdefault((phase_of(config, step, phases), patterns), step)
    return tuple(distinct.values())


def place_in(cycle: range, step: int) -> int:
    """The step of the first cycle (`walking_steps`) that does the same as `step`."""
    return cycle.start + (step - cycle.start) % len(cycle) if step >= cycle.start else step


def first_step(config: Config, begun: int = 0) -> int:
    """The team's first planning step: it walks, and all windows can be complete.

    Args:
        config: the team's configuration.
        begun: tick at which the first sample begins.
    """
    samples = config.planner.T_ini + config.planner.applied
    ready_ms = max(config.gait.stand_ms, begun + SAMPLE_MS * samples)
    return -(-ready_ms // step_ms(config))


def first_due_step(config: Config, since: int) -> int:
    """The first step at which plans of and for a robot are due that has walked since a tick.

    Of one that begins in the midst of a walk none is due before its window is whole.
    """
    first = first_step(config)
    return max(first, first_step(config, since)) if since > config.gait.stand_ms else first


def patience(config: Config) -> int:
    """Planning steps for which a team does without a plan that ought to be there."""
    return config.planner.max_peer_age + config.planner.hold_steps


def gait_phase(tick: int, stand_ms: int, stance_ms: int, phases: int) -> int:
    """Which of `phases` equal parts of the gait's period (two stance times) a tick lies in."""
    period = 2 * stance_ms
    return (tick - stand_ms) % period * phases // period


def phase_of(config: Config, step: int, phases: int) -> int:
    """Which of `phases` equal parts of the gait's period planning step `step` lies in."""
    gait = config.gait
    return gait_phase(step * step_ms(config), gait.stand_ms, gait.stance_ms, phases)
