"""Sizes and scales of a predictor: all that the numerics of its fits need to know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from quadriga.shared.robot.conventions import Array


@dataclass(frozen=True, slots=True)
class Layout:
    """How a predictor of any plant is laid out; nothing in it is about robots.

    Attributes:
        agents: n, parts of the plant with inputs and outputs of their own.
        inputs: m, of each agent.
        outputs: p, of each agent.
        T_ini: samples of the past.
        N: samples of the horizon.
        u_scale: of an agent's inputs, m numbers; fits see inputs divided by them.
        y_scale: of its outputs, p numbers.
        members: of every agent: whose columns explain its outputs, in order, itself among them.
    """

    agents: int
    inputs: int
    outputs: int
    T_ini: int
    N: int
    u_scale: tuple[float, ...]
    y_scale: tuple[float, ...]
    members: tuple[tuple[int, ...], ...]

    @property
    def past(self) -> int:
        """Columns of a block that belong to [u_ini; y_ini]."""
        return (self.inputs + self.outputs) * self.T_ini

    @property
    def width(self) -> int:
        """W, columns of a block: length of one agent's [u_ini; y_ini; u]."""
        return self.past + self.inputs * self.N

    @property
    def rows(self) -> int:
        """Rows of a block: length of one agent's outputs over the horizon, p N."""
        return self.outputs * self.N

    def strangers(self, i: int) -> list[int]:
        """Agents whose columns do not explain the outputs of agent `i`."""
        return [j for j in range(self.agents) if j not in self.members[i]]


def everyone(agents: int) -> tuple[tuple[int, ...], ...]:
    """The `members` of a plant in which each agent's outputs may depend on all agents."""
    return (tuple(range(agents)),) * agents


def scales(layout: Layout) -> tuple[Array, Array]:
    """Scales of one agent's [u_ini; y_ini; u], shape (W,), and y, shape (p N,)."""
    u, y = np.array(layout.u_scale), np.array(layout.y_scale)
    parts = [np.tile(u, layout.T_ini), np.tile(y, layout.T_ini), np.tile(u, layout.N)]
    return np.concatenate(parts), np.tile(y, layout.N)
