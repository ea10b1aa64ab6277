"""The peers' terms of eq. 11, from their newest messages; those of a silent peer are held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.cooperation import (
    brings_forward,
    is_cooperative,
    peer_slope,
    team_slope,
)
from quadriga.agents.planner.coupling import Coupling, fill_deviations
from quadriga.agents.planner.neighbours import PeerData, PeerSelection
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
        z, deviations = self._zero_deviations(), {}
        held: dict[str, Array] = {}
        for peer in selection.peers:
            if peer.usable:
                part = deviations[peer.robot] = self._part(z, peer.index)
                fill_deviations(part, peer.du_ini, peer.y_ini, y_base, peer.known, peer.du)
                continue
            share = self._last_share(before, peer)
            if share is not None:
                held[peer.robot] = share
        effect, slope = self._divide(self._coupling(step, selection.window_step).effect(z))
        for share in held.values():
            effect += self._own_part(share)
            slope += self._slope_of(share, step)
        ages = {peer.robot: peer.age for peer in selection.peers}
        steps = step, selection.window_step
        return PeerTerms(
            effect, slope, deviations, held, steps, selection.used, selection.lost, ages
        )

    def _divide(self, effect: Array) -> tuple[Array, Array | float]:
        """A coupling's effect on own outputs, and on the slope of the team's cost."""
        if not self._cooperative:
            return effect, 0.0
        outputs = N_OUTPUTS * self._config.planner.N
        return effect[:outputs], effect[outputs:]

    def _own_part(self, share: Array) -> Array:
        """The effect on own outputs of what a silent peer did last."""
        if not self._cooperative:
            return share
        outputs = N_OUTPUTS * self._config.planner.N
        return share[self._index * outputs : (self._index + 1) * outputs]

    def _slope_of(self, share: Array, step: int) -> Array | float:
        """The slope of the team's cost at a planning step that an effect on all outputs makes."""
        if not self._cooperative:
            return 0.0
        slopes = self._slopes(step)
        return np.tensordot(slopes, share.reshape(len(slopes), -1), axes=([0, 2], [0, 1]))

    def _last_share(self, before: PeerTerms, peer: PeerData) -> Array | None:
        """A silent peer's last share of the effect, (6 N,); None if it never sent a plan.

        It is computed for the steps of the peer's last deviations: legs that stood then swing now.
        """
        part = before.deviations.get(peer.robot)
        if part is None:
            return before.held.get(peer.robot)
        if self._cooperative:
            phase = self._phase(before.steps[0])
            robots = range(self._config.team.robots)
            blocks = [self._predictor.block(j, peer.index, phase) for j in robots]
            return np.concatenate([block @ part for block in blocks])
        z = self._zero_deviations()
        self._part(z, peer.index)[:] = part
        return self._coupling(*before.steps).effect(z)

    def _zero_deviations(self) -> NDArray[np.float32]:
        """No deviation of any peer."""
        return np.zeros(len(self._others) * self._predictor.meta.width, dtype=np.float32)

    def _part(self, z: NDArray[np.float32], index: int) -> NDArray[np.float32]:
        """The part of all peers' deviations `z` that belongs to one peer, as a view."""
        width = self._predictor.meta.width
        place = width * (index - (index > self._index))
        return z[place : place + width]

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
