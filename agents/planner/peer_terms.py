"""The peers' terms of eq. 11, from their newest messages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import horizon_stance, phase_of, place_in, walking_steps
from quadriga.agents.planner.cooperation import (
    brings_forward,
    is_cooperative,
    peer_slope,
    team_slope,
)
from quadriga.agents.planner.peers import USABLE, PeerSelection
from quadriga.agents.planner.qp import stance_columns
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.robots.conventions import N_OUTPUTS, Array
from quadriga.shared.runtime.record import record


@record
class PeerTerms:
    """Effect of the peers on an agent's outputs at one planning step (eq. 11).

    Attributes:
        effect: Σ G_ij [u_ini; y_ini; u] over the peers, (6 N,).
        slope: Σ M_ij [u_ini; y_ini; u] over the peers, what they add to the slope of the team's
            cost by own stance forces, (nv,); 0 where each agent has its own cost.
        steps: planning step, and step at which the peers' windows end.
        used: step of the plan used, by peer.
        lost: peers given up; the agent stops if there are any.
        ages: number of steps by which each peer's plan is older than the newest one allowed.
    """

    effect: Array | float = 0.0
    slope: Array | float = 0.0
    steps: tuple[int, int] = (0, 0)
    used: Mapping[str, int] = field(default_factory=dict)
    lost: tuple[str, ...] = ()
    ages: Mapping[str, int] = field(default_factory=dict)


class Peers:
    """Fixed data of one agent's coupling to its peers; its functions depend on arguments alone.

    Args:
        config: the team's configuration.
        index: this agent's place in the team, 0-based.
        predictor: fitted for this team.
    """

    def __init__(self, config: Config, index: int, predictor: Predictor) -> None:
        self._config, self._index, self._predictor = config, index, predictor
        self._others = [j for j in range(config.team.robots) if j != index]
        # Memo of the couplings, one for each step of the gait's cycle; it changes no result.
        self._couplings: dict[tuple[int, int], Coupling] = {}
        self._cycle = walking_steps(config)
        self._cooperative = is_cooperative(config)
        behind = {0 if brings_forward(config) else 1}
        if config.planner.exchanges:
            behind.add(0)
        # The cycle's first step is set up twice: later its plans also begin at a step of the walk.
        for step in (*self._cycle, self._cycle.stop):
            for steps in behind:
                self._coupling(step, step - steps)

    def terms(self, selection: PeerSelection, step: int, y_base: Array) -> PeerTerms:
        """The peers' terms of eq. 11 for planning step `step`.

        Args:
            selection: the peers' windows and plans.
            step: k, whose contact phase chooses the transition matrix.
            y_base: base of the outputs at the ends of the windows' samples, (T_ini, 6).
        """
        if not selection.peers:
            return PeerTerms()
        z = np.zeros((len(self._others), self._predictor.meta.width), dtype=np.float32)
        for peer in selection.peers:
            if peer.status == USABLE:
                dy = np.where(peer.known[:, None], peer.y_ini - y_base, 0.0)
                part = z[peer.index - (peer.index > self._index)]
                past = peer.du_ini.size
                part[:past], part[past : past + dy.size] = peer.du_ini.ravel(), dy.ravel()
                part[past + dy.size :] = peer.du.ravel()
        total = self._coupling(step, selection.window_step).effect(z.ravel())
        outputs = N_OUTPUTS * self._config.planner.N
        return PeerTerms(
            total[:outputs],
            total[outputs:] if self._cooperative else 0.0,
            (step, selection.window_step),
            selection.used,
            selection.lost,
            {peer.robot: peer.age for peer in selection.peers},
        )

    def _coupling(self, step: int, window_step: int) -> Coupling:
        """The coupling at planning step `step` to plans that begin at `window_step`."""
        place = place_in(self._cycle, step), place_in(self._cycle, window_step)
        coupling = self._couplings.get(place)
        if coupling is None:
            stance = [horizon_stance(self._config, j, window_step) for j in self._others]
            coupling = self._couplings[place] = Coupling(self._blocks(step), stance)
        return coupling

    def _blocks(self, step: int) -> list[Array]:
        """G_ij of each peer; with the team's cost [G_ij; M_ij]."""
        config, index, predictor = self._config, self._index, self._predictor
        phase = phase_of(config, step, predictor.phases)
        blocks = [predictor.block(index, j, phase) for j in self._others]
        if not self._cooperative:
            return blocks
        stance = horizon_stance(config, index, step)
        slopes = team_slope(config, predictor, index, phase, stance)
        rows = [peer_slope(slopes, predictor, j, phase) for j in self._others]
        return [np.concatenate(pair) for pair in zip(blocks, rows, strict=True)]


class Coupling:
    """Effect of the peers on one agent's outputs over a horizon with a given stance schedule.

    A swinging leg of a peer carries no force: its columns, a third of all, are left out, which is
    exact. Single precision changes an effect by 3e-7 of its size and halves the memory that is
    read.

    Args:
        G: the block G_ij of each peer, (6 N, 18 T_ini + 12 N), or one with any other rows.
        stance: of each peer over its plan, (N, 4).
    """

    def __init__(self, G: Sequence[Array] | Array, stance: Sequence[NDArray[np.bool_]]) -> None:
        columns, rows = [np.zeros(0, dtype=np.int64)], [np.zeros((len(G[0]) if len(G) else 0, 0))]
        for i, (block, legs) in enumerate(zip(G, stance, strict=True)):
            past = block.shape[1] - 3 * legs.size
            kept = np.concatenate([np.arange(past), past + stance_columns(legs)])
            columns.append(i * block.shape[1] + kept)
            rows.append(block[:, kept])
        self._columns = np.concatenate(columns)
        self._rows = np.ascontiguousarray(np.concatenate(rows, axis=1), dtype=np.float32)

    def effect(self, z: NDArray[np.float32]) -> Array:
        """The sum for all peers' deviations [u_ini; y_ini; u], (n − 1)(18 T_ini + 12 N).

        Shape (6 N,), or as many as the blocks have rows.
        """
        return (self._rows @ z[self._columns]).astype(np.float64)
