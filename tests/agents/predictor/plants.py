"""Linear plants of any size, and data of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from quadriga.agents.predictor.four_tank import LinearPlant
from quadriga.agents.predictor.plant import Data
from quadriga.shared.robots.conventions import Array


class Sizes(NamedTuple):
    """Of a plant: agents, inputs and outputs of each, and states of all together."""

    agents: int
    inputs: int
    outputs: int
    states: int


def random_plant(sizes: Sizes, seed: int) -> LinearPlant:
    """A stable plant all of whose states are seen and moved, with direct feedthrough."""
    rng, states = np.random.default_rng(seed), sizes.states
    m, p = sizes.agents * sizes.inputs, sizes.agents * sizes.outputs
    turn = np.linalg.qr(rng.normal(size=(states, states)))[0]
    A = 0.9 * turn @ np.diag(rng.uniform(0.6, 1.0, states))
    B, C, D = (rng.normal(size=shape) for shape in ((states, m), (p, states), (p, m)))
    return LinearPlant(A, B, C, D)


def record(
    plant: LinearPlant, sizes: Sizes, lengths: Sequence[int], seed: int, noise: float = 0.0
) -> Data:
    """Episodes under random inputs from random states, with an axis of agents."""
    rng = np.random.default_rng(seed)
    inputs, outputs = [], []
    for length in lengths:
        plant.x = rng.normal(size=sizes.states)
        u = rng.normal(size=(length, sizes.agents * sizes.inputs))
        y = plant.respond(u)
        y = y + noise * rng.normal(size=y.shape)
        inputs.append(u.reshape(length, sizes.agents, -1))
        outputs.append(y.reshape(length, sizes.agents, -1))
    return Data(inputs, outputs)


def split_window(data: Data, past: int, horizon: int) -> tuple[Array, Array, Array, Array]:
    """The first window of the first episode: past_u, past_y, future_u, future_y."""
    u, y = data.u[0], data.y[0]
    end = past + horizon
    return u[:past], y[:past], u[past:end], y[past:end]
