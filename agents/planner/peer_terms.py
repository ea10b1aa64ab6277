"""The peers' terms of eq. 11, from their newest messages; those of a silent peer are held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.planner.coupling import Coupling, fill_deviations
from quadriga.agents.planner.neighbours import PeerData, PeerSelection
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.time_grid import horizon_stance, phase_of, place_in, walking_steps
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.conventions import Array
from quadriga.shared.runtime.record import record


@record
class PeerTerms:
    """Effect of the peers on an agent's outputs at one planning step (eq. 11).

    Attributes:
        effect: Σ G_ij [u_ini; y_ini; u] over the peers, (6 N,).
        deviations: [u_ini; y_ini; u] of each peer with a usable plan, (18 T_ini + 12 N,).
        held: last share of the effect of each silent peer, (6 N,).
        steps: planning step, and step at which the peers' windows end.
        used: step of the plan used, by peer.
        lost: peers given up; the agent stops if there are any.
        ages: number of steps by which each peer's plan is older than the newest one allowed.
    """

    effect: Array | float = 0.0
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
        behind = {0 if config.planner.compensation else 1}
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
        effect = self._coupling(step, selection.window_step).effect(z)
        for share in held.values():
            effect += share
        ages = {peer.robot: peer.age for peer in selection.peers}
        steps = step, selection.window_step
        return PeerTerms(effect, deviations, held, steps, selection.used, selection.lost, ages)

    def _last_share(self, before: PeerTerms, peer: PeerData) -> Array | None:
        """A silent peer's last share of the effect, (6 N,); None if it never sent a plan.

        It is computed for the steps of the peer's last deviations: legs that stood then swing now.
        """
        part = before.deviations.get(peer.robot)
        if part is None:
            return before.held.get(peer.robot)
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
            phase = phase_of(self._config, step, self._predictor.phases)
            G = self._predictor.G[phase][self._index, self._others]
            stance = [horizon_stance(self._config, j, window_step) for j in self._others]
            coupling = self._couplings[place] = Coupling(G, stance)
        return coupling
