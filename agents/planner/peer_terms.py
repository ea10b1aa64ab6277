"""The peers' terms of eq. 11, from their newest messages; those of a silent peer are held."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.cooperation import (
    brings_forward,
    is_cooperative,
    peer_slope,
    team_slope,
)
from quadriga.agents.planner.peers import USABLE, PeerData, PeerSelection
from quadriga.agents.planner.qp import stance_columns
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.time_grid import horizon_stance, phase_of, place_in, walking_steps
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
        deviations: [u_ini; y_ini; u] of each peer with a usable plan, (18 T_ini + 12 N,).
        held: last effect of each silent peer, (6 N,); where the cost is the team's, on all robots,
            (6 N n,).
        steps: planning step, and step at which the peers' windows end.
        used: step of the plan used, by peer.
        lost: peers given up; the agent stops if there are any.
        ages: number of steps by which each peer's plan is older than the newest one allowed.
    """

    effect: Array | float = 0.0
    slope: Array | float = 0.0
    deviations: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    held: Mapping[str, Array] = field(default_factory=dict)
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
        self._outputs, self._width = N_OUTPUTS * config.planner.N, predictor.meta.width
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

    def terms(
        self, before: PeerTerms, selection: PeerSelection, step: int, y_base: Array
    ) -> PeerTerms:
        """The peers' terms of eq. 11 for planning step `step`; of silent peers their last share.

        Args:
            before: terms of the step before.
            selection: the peers' windows and plans.
            step: k, whose contact phase chooses the transition matrix.
            y_base: base of the outputs at the ends of the windows' samples, (T_ini, 6).
        """
        if not selection.peers:
            return PeerTerms()
        z = np.zeros(len(self._others) * self._width, dtype=np.float32)
        deviations, held = dict[str, NDArray[np.float32]](), dict[str, Array]()
        for peer in selection.peers:
            if peer.status == USABLE:
                dy = np.where(peer.known[:, None], peer.y_ini - y_base, 0.0)
                part = deviations[peer.robot] = self._part(z, peer.index)
                part[:] = np.concatenate([peer.du_ini.ravel(), dy.ravel(), peer.du.ravel()])
                continue
            share = self._last_share(before, peer)
            if share is not None:
                held[peer.robot] = share
        total = self._coupling(step, selection.window_step).effect(z)
        effect, slope = total[: self._outputs], total[self._outputs :]
        for share in held.values():
            if not self._cooperative:
                effect += share
                continue
            effect += share[self._index * self._outputs :][: self._outputs]
            slopes = self._slopes(step)
            slope += np.tensordot(slopes, share.reshape(len(slopes), -1), axes=([0, 2], [0, 1]))
        return PeerTerms(
            effect,
            slope if self._cooperative else 0.0,
            deviations,
            held,
            (step, selection.window_step),
            selection.used,
            selection.lost,
            {peer.robot: peer.age for peer in selection.peers},
        )

    def _last_share(self, before: PeerTerms, peer: PeerData) -> Array | None:
        """A silent peer's last share of the effect, see `PeerTerms.held`; None if it sent no plan.

        It is computed for the steps of the peer's last deviations: legs that stood then swing now.
        """
        deviation = before.deviations.get(peer.robot)
        if deviation is None:
            return before.held.get(peer.robot)
        if self._cooperative:
            phase = self._phase(before.steps[0])
            robots = range(self._config.team.robots)
            blocks = [self._predictor.block(j, peer.index, phase) for j in robots]
            return np.concatenate([block @ deviation for block in blocks])
        z = np.zeros(len(self._others) * self._width, dtype=np.float32)
        self._part(z, peer.index)[:] = deviation
        return self._coupling(*before.steps).effect(z)

    def _part(self, z: NDArray[np.float32], index: int) -> NDArray[np.float32]:
        """The part of all peers' deviations `z` that belongs to one peer, as a view."""
        place = self._width * (index - (index > self._index))
        return z[place : place + self._width]

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
        phase = self._phase(step)
        blocks = [self._predictor.block(self._index, j, phase) for j in self._others]
        if not self._cooperative:
            return blocks
        slopes = self._slopes(step)
        return [
            np.concatenate([block, peer_slope(slopes, self._predictor, j, phase)])
            for block, j in zip(blocks, self._others, strict=True)
        ]

    def _slopes(self, step: int) -> Array:
        """See `team_slope`."""
        stance = horizon_stance(self._config, self._index, step)
        return team_slope(self._config, self._predictor, self._index, self._phase(step), stance)

    def _phase(self, step: int) -> int:
        return phase_of(self._config, step, self._predictor.phases)


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
