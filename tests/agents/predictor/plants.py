"""Linear plants of any size, and data of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from quadriga.agents.predictor.episode import Episode
from quadriga.shared.robots.conventions import Array


class Sizes(NamedTuple):
    """Of a plant: agents, inputs and outputs of each, and states of all together."""

    agents: int
    inputs: int
    outputs: int
    states: int


@dataclass
class LinearPlant:
    """x⁺ = A x + B u, y = C x + D u; it keeps its state from call to call."""

    A: Array
    B: Array
    C: Array
    D: Array
    x: Array

    def respond(self, u: Array) -> Array:
        """Outputs (T, p) to inputs (T, m) from the present state."""
        y = np.empty((len(u), len(self.C)))
        for k, now in enumerate(u):
            y[k] = self.C @ self.x + self.D @ now
            self.x = self.A @ self.x + self.B @ now
        return y


def random_plant(sizes: Sizes, seed: int) -> LinearPlant:
    """A stable plant all of whose states are seen and moved, with direct feedthrough."""
    rng, states = np.random.default_rng(seed), sizes.states
    m, p = sizes.agents * sizes.inputs, sizes.agents * sizes.outputs
    turn = np.linalg.qr(rng.normal(size=(states, states)))[0]
    A = 0.9 * turn @ np.diag(rng.uniform(0.6, 1.0, states))
    B, C, D = (rng.normal(size=shape) for shape in ((states, m), (p, states), (p, m)))
    return LinearPlant(A, B, C, D, np.zeros(states))


def record(
    plant: LinearPlant, sizes: Sizes, lengths: Sequence[int], seed: int, noise: float = 0.0
) -> list[Episode]:
    """Episodes under random inputs from random states."""
    rng, episodes = np.random.default_rng(seed), []
    for length in lengths:
        plant.x = rng.normal(size=sizes.states)
        u = rng.normal(size=(length, sizes.agents * sizes.inputs))
        y = plant.respond(u)
        y = y + noise * rng.normal(size=y.shape)
        shape = (length, sizes.agents, -1)
        episodes.append(Episode.of(u.reshape(shape), y.reshape(shape)))
    return episodes


def first_window(episode: Episode, T_ini: int, N: int) -> tuple[Array, Array, Array, Array]:
    """past_u, past_y, future_u and future_y of an episode's first window."""
    u, y, end = episode.u, episode.y, T_ini + N
    return u[:T_ini], y[:T_ini], u[T_ini:end], y[T_ini:end]
