"""Adaptation to a plant that is not the one of the data: an agent corrects its own block G_ii."""

from __future__ import annotations

import numpy as np

from quadriga.agents.gait import nominal_forces
from quadriga.agents.planning.operator_references import base_of_samples
from quadriga.agents.planning.window import is_gapless
from quadriga.agents.plausibility import is_plausible
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.recursive import (
    Correction,
    Forgetting,
    begin_correction,
    block_correction,
    take_in,
)
from quadriga.agents.time_grid import gait_phase
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array
from quadriga.shared.wire.messages import Measurement, Reference


class Adapter:
    """Fixed data of one agent's adaptation; its functions depend on their arguments alone.

    What the peers did in a window is not looked up again. It counts as noise.

    Args:
        config: the team's configuration.
        index: the agent's place in the team, 0-based.
        predictor: the fitted predictor, which is corrected.

    Attributes:
        samples: length of a window, T_ini + N.
    """

    def __init__(self, config: Config, index: int, predictor: Predictor) -> None:
        self._config, self._index, self._predictor = config, index, predictor
        self._forgetting = Forgetting(config.planner.forgetting)
        self.samples = config.planner.T_ini + config.planner.N

    def learn_newest(
        self,
        known: Correction | None,
        own: tuple[Measurement, ...],
        tick: int,
        references: tuple[Reference, ...],
    ) -> tuple[Correction | None, bool]:
        """Take in the window that ends at `tick`, if it is whole.

        Args:
            known: the correction so far; None before the first window.
            own: the agent's last samples, at most `samples` of them.
            tick: the present one.
            references: what the operator asked for lately.

        Returns:
            The correction, and whether the window was refused.
        """
        if not is_gapless(own, self.samples, tick):
            return known, False
        y_base = base_of_samples(self._config, tick, self.samples, references)
        correction = self.learn(known, own, y_base)
        return correction, correction.refused > (0 if known is None else known.refused)

    def learn(
        self, known: Correction | None, own: tuple[Measurement, ...], y_base: Array
    ) -> Correction:
        """Take in a window, unless its numbers are implausible.

        Args:
            known: the correction so far; None before the first window.
            own: the agent's samples of the window, without gaps, `samples` of them.
            y_base: base of the outputs at their ends, shape (samples, 6).
        """
        if known is None:
            known = begin_correction(self._predictor.meta.layout, self._index, self._forgetting)
        T_ini, gait = self._config.planner.T_ini, self._config.gait
        stance = np.array([sample.stance for sample in own]) > 0.5
        u, y = np.array([sample.u for sample in own]), np.array([sample.y for sample in own])
        if not is_plausible(self._config, u, y):
            return known.refuse()
        du, dy = u - nominal_forces(stance, self._config.robot.weight), y - y_base
        z = np.zeros((self._predictor.meta.robots, self._predictor.meta.width))
        z[self._index] = np.concatenate(
            [du[:T_ini].ravel(), dy[:T_ini].ravel(), du[T_ini:].ravel()]
        )
        phase = gait_phase(
            own[T_ini - 1].tick, gait.stand_ms, gait.stance_ms, self._predictor.phases
        )
        return take_in(known, self._predictor, z, dy[T_ini:].ravel(), phase, self._forgetting)

    def block(self, correction: Correction, phase: int) -> Array:
        """The corrected G_ii. Shape (6 N, 18 T_ini + 12 N)."""
        G_ii = self._predictor.block(self._index, self._index, phase)
        return G_ii + block_correction(self._predictor.meta.layout, correction)
