"""The trot and the planning steps as pure functions of world time.

Which feet are scheduled to stand when, and where samples, planning steps and their horizons lie.
"""

from __future__ import annotations

from functools import lru_cache
from math import lcm

import numpy as np
from numpy.typing import NDArray

from quadriga.shared.config.sections import Config
from quadriga.shared.modes import STOPPING, WALK, Mode
from quadriga.shared.robots.conventions import N_LEGS, Array
from quadriga.shared.topics import SAMPLE_MS

# Diagonal pairs in the leg order FL FR RL RR: row 0 stands in the first half cycle.
_BITS = np.array([8, 4, 2, 1])
_PAIRS = np.array([[True, False, False, True], [False, True, True, False]])
# Rows of a gait: scheduled stance of the four legs, 1 or 0; progress of the half cycle in [0, 1);
# its number, 0 or 1, and −1 of a robot that stands on four feet.
STANDING = np.array([1.0, 1.0, 1.0, 1.0, 0.5, -1.0])


def phase_offset_ms(config: Config, index: int) -> int:
    """Shift of robot `index`'s gait: every second robot trots half a period later."""
    return config.gait.stance_ms if config.team.alternate_phase and index % 2 else 0


def scheduled_stance(config: Config, index: int, ticks: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Scheduled stance of robot `index` (0-based) at each tick. Shape (len(ticks), 4)."""
    since = ticks - config.gait.stand_ms
    half_cycle = ((since + phase_offset_ms(config, index)) // config.gait.stance_ms) % 2
    return np.where((since < 0)[:, None], True, _PAIRS[half_cycle])


def nominal_forces(stance: NDArray[np.bool_], weight: float) -> Array:
    """Forces that carry the robot's weight, m g, evenly on its stance feet (the paper's u_des).

    Shape (..., 12), of a scheduled stance (..., 4): per leg (0, 0, m g / N_c) for stance legs and
    zero for swing legs, N.
    """
    forces: Array = nominal_table(weight)[stance @ _BITS]
    return forces


@lru_cache
def nominal_table(weight: float) -> Array:
    """Nominal forces of all 16 stance patterns, by the bits of the legs. Shape (16, 12), N."""
    stance = np.arange(16)[:, None] & _BITS > 0
    table = np.zeros((16, 3 * N_LEGS))
    table[:, 2::3] = stance * weight / np.maximum(stance.sum(axis=1), 1)[:, None]
    table.setflags(write=False)
    return table


class Gait:
    """The gait of robot `index` (0-based), looked up at each tick."""

    def __init__(self, config: Config, index: int) -> None:
        stance_ms, self._stand_ms = config.gait.stance_ms, config.gait.stand_ms
        since = np.arange(2 * stance_ms)  # the end of the stand
        half_cycle, within = np.divmod(since + phase_offset_ms(config, index), stance_ms)
        half_cycle %= 2
        self._cycle = np.column_stack([_PAIRS[half_cycle], within / stance_ms, half_cycle])

    def at(self, tick: int, mode: Mode) -> Array:
        """The gait at `tick`, see `STANDING`; in modes without a trot all four legs stand."""
        if mode.name not in (WALK, STOPPING):
            return STANDING
        row: Array = self._cycle[(tick - self._stand_ms) % len(self._cycle)]
        return row


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
    """The team's first planning step: it walks, and all windows that begin at a tick are whole."""
    samples = config.planner.T_ini + config.planner.applied
    ready_ms = max(config.gait.stand_ms, begun + SAMPLE_MS * samples)
    return -(-ready_ms // step_ms(config))


def first_due_step(config: Config, since: int) -> int:
    """The first step at which plans of and for a robot are due that has walked since a tick.

    Of one that begins in the midst of a walk none is due before its window is whole.
    """
    return first_step(config, since if since > config.gait.stand_ms else 0)


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
