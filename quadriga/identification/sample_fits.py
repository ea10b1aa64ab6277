"""Every fit of a small data set, and the gates: what a predictor depends on besides its data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from quadriga.agents.gait import nominal_forces, sample_starts, scheduled_stance
from quadriga.agents.predictor.episode import U_SCALE, Y_SCALE, Episode
from quadriga.agents.predictor.gates import coupling_table, held_out_error, run_gates
from quadriga.agents.predictor.predictor import KINDS, PredictorMeta, fit
from quadriga.identification.behaviour import numbers
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array
from quadriga.shared.runtime.arithmetic import use_one_blas_thread

_ROBOTS: Final = 3
_SAMPLES: Final = 400  # of an episode
_STATES: Final = 8  # of each robot
_KEYS: Final = {"team.robots": _ROBOTS, "planner.N": 6, "planner.T_ini": 3}


def samples() -> Iterator[Array]:
    """Each fit's G and what the gates say of it."""
    use_one_blas_thread()
    config = load(None, _KEYS)
    first, second, held_out = (linear_episode(config, _SAMPLES, seed) for seed in range(3))
    for kind in KINDS:
        for neighbours in ("all", "yoked"):
            chosen = replace(config.identification, predictor=kind, neighbours=neighbours)
            of_kind = replace(config, identification=chosen)
            predictor = fit((first, second), PredictorMeta.of(of_kind))
            yield predictor.G
            gates = run_gates(of_kind, predictor, (held_out,))
            # Not the condition: its last bit depends on where in memory the arrays lie.
            yield numbers(gates.error, gates.radius)
            yield from (np.array(gates.gains), coupling_table(predictor))
            yield from (numbers(*bounds) for bounds in gates.harm.values())
            yield np.array(held_out_error(predictor, (held_out,))[:2])


def linear_episode(config: Config, samples: int, seed: int) -> Episode:
    """A walk of robots that are linear systems, each coupled with all others."""
    n = config.team.robots
    plant, random = np.random.default_rng(7), np.random.default_rng(seed)
    states = _STATES * n
    A = 0.9 * np.linalg.qr(plant.normal(size=(states, states)))[0]
    B = plant.normal(size=(states, N_FORCES * n)) / states
    C = plant.normal(size=(N_OUTPUTS * n, states)) / states
    du = random.normal(size=(samples, N_FORCES * n))
    dy, x = np.zeros((samples, N_OUTPUTS * n)), np.zeros(states)
    for k in range(samples):
        x = A @ x + B @ du[k]
        dy[k] = C @ x + 0.01 * random.normal(size=N_OUTPUTS * n)
    first = config.gait.stand_ms + 10
    stance = np.stack(
        [scheduled_stance(config, i, sample_starts(first, samples)) for i in range(n)], axis=1
    )
    nominal = nominal_forces(stance, config.robot.weight)
    du = du.reshape(samples, n, N_FORCES) * U_SCALE
    base = np.zeros((samples, n, N_OUTPUTS))
    return Episode(
        nominal + du, nominal, base + dy.reshape(base.shape) * Y_SCALE, base, first_tick=first
    )
