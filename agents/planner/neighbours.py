"""The one-step communication delay: which of its peers' messages an agent uses at step k.

At step k each peer's plan and T_ini window of step k−1 are used (eq. 11), never those of step k,
unless the agents answer each other within a step (`planner.exchanges`).
Pure: messages in, selection out; lost, repeated, late and foreign messages are all accounted for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import nominal_forces, scheduled_stance
from quadriga.agents.planner.peer_memory import PeerHistory, PeerMemory, remember
from quadriga.agents.time_grid import horizon_stance, patience, sample_starts, step_ms
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Plan
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array, robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import MEASUREMENT, SAMPLE_MS

FRESH: Final = "fresh"  # the newest plan that may be used: that of step k−1
SHIFTED: Final = "shifted"  # an older one, shifted by its age
HELD: Final = "held"  # too old: the effect of the peer's last terms stays in force
LOST: Final = "lost"  # held long enough, or the peer has stopped: the team stops


@record
class PeerData:
    """One peer's part of eq. 11 at planning step k; its window ends at `PeerSelection.window_step`.

    Attributes:
        robot: the peer's name.
        index: its place in the team, 0-based.
        status: fresh, shifted, held or lost; the arrays of a held or lost peer must not be used.
        step: step of the plan used, or None while the peer has never planned.
        age: number of steps by which that plan is older than the newest one allowed.
        known: samples of the window that are measured or predicted, shape (T_ini,).
        du_ini: force deviations of the window, zero where unknown, shape (T_ini, 12), N.
        y_ini: outputs of the window, shape (T_ini, 6); meaningless where unknown.
        du: planned force deviations from the window's end on, shape (N, 12), N.
    """

    robot: str
    index: int
    status: str
    step: int | None
    age: int
    known: NDArray[np.bool_]
    du_ini: Array
    y_ini: Array
    du: Array

    @property
    def usable(self) -> bool:
        """Whether the arrays are recent enough to predict from."""
        return self.status in (FRESH, SHIFTED)


@record
class PeerSelection:
    """Everything an agent takes from its peers at one planning step.

    Attributes:
        peers: each peer's part.
        window_step: planning step at which the peers' windows end.
    """

    peers: tuple[PeerData, ...] = ()
    window_step: int = 0

    @property
    def used(self) -> dict[str, int]:
        """Step of the plan used, by peer; peers that never planned are left out."""
        return {peer.robot: peer.step for peer in self.peers if peer.step is not None}

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the peers given up."""
        return tuple(peer.robot for peer in self.peers if peer.status == LOST)


class Neighbours:
    """The delay protocol of one agent; holds no state beyond its configuration.

    Args:
        config: the team's configuration.
        index: this agent's place in the team, 0-based.
        peers: places of the robots that matter to it; None: all others.

    Attributes:
        names: of these robots.
    """

    def __init__(self, config: Config, index: int, peers: frozenset[int] | None = None) -> None:
        self._config = config
        self._indices = {
            name: j
            for j, name in enumerate(robot_names(config.team.robots))
            if (j != index if peers is None else j in peers)
        }
        self.names = tuple(self._indices)

    def initial(self) -> PeerMemory:
        """The memory before the first message."""
        return PeerMemory({name: PeerHistory() for name in self._indices})

    def remember(
        self,
        memory: PeerMemory,
        tick: int,
        measurements: Iterable[tuple[str, Measurement]] = (),
        plans: Iterable[tuple[str, Plan]] = (),
    ) -> PeerMemory:
        """See `peer_memory.remember`."""
        return remember(self._config, memory, tick, measurements, plans)

    def are_ready(self, memory: PeerMemory, tick: int) -> bool:
        """Whether the samples of all peers come at `tick`, and each stands or plans."""
        recent = tick - patience(self._config) * step_ms(self._config)
        return all(
            history.measurements
            and tick - history.measurements[-1].tick <= MEASUREMENT.max_age_ms
            and (_stands(history) or (history.plans and history.plans[-1].tick >= recent))
            for history in memory.peers.values()
        )

    def forget_plans(self, memory: PeerMemory, before: int) -> PeerMemory:
        """The memory without plans of before a tick."""
        peers = {
            name: replace(history, plans=tuple(p for p in history.plans if p.tick >= before))
            for name, history in memory.peers.items()
        }
        return replace(memory, peers=peers)

    def is_complete(self, memory: PeerMemory, serial: tuple[int, int]) -> bool:
        """Whether every peer's plan of this step and exchange is there, and its window before it.

        Args:
            memory: what has been remembered.
            serial: step and exchange, see `Plan.serial`.
        """
        end = serial[0] * step_ms(self._config)
        for history in memory.peers.values():
            if not history.plans or history.plans[-1].serial < serial:
                return False
            if not history.measurements or history.measurements[-1].tick < end:
                return False
        return True

    def select(
        self, memory: PeerMemory, last: int, first_step: int, *, window_step: int | None = None
    ) -> PeerSelection:
        """Choose the plan and the window of each peer that a planning step uses.

        Before its first plan has arrived a peer is assumed to have planned no deviation at step
        first_step − 1, so that the first planning step needs nobody's plan.

        Args:
            memory: what has been remembered.
            last: newest step whose plans and samples are looked at; with the one-step delay k−1.
            first_step: the team's first planning step.
            window_step: planning step at which the windows end: `last`, as in eq. 11, or a later
                one, which moves windows and plans forward and takes samples not measured yet from
                the plans.
        """
        end = last if window_step is None else window_step
        peers = [
            self._select_peer(name, memory.peers[name], last, end, first_step)
            for name in self._indices
        ]
        return PeerSelection(tuple(peers), end)

    def lost_peers(self, memory: PeerMemory, last: int, first_step: int) -> tuple[str, ...]:
        """Names of the peers given up, those that `select` would call lost."""
        return tuple(
            name
            for name, history in memory.peers.items()
            if self._status(history, _newest(history, last), last, first_step) == LOST
        )

    def _status(self, history: PeerHistory, newest: Plan | None, last: int, first_step: int) -> str:
        """Status of a peer at step `last`, whose newest plan until then this is."""
        age = _age(newest, last, first_step)
        if age > patience(self._config) or self._has_stopped(history, newest, last):
            return LOST
        if age > self._config.planner.max_peer_age:
            return HELD
        return FRESH if age <= 0 else SHIFTED

    def _has_stopped(self, history: PeerHistory, newest: Plan | None, last: int) -> bool:
        """Whether a peer has come to stand since its newest plan: it makes none any more."""
        end = last * step_ms(self._config)
        sample = next((s for s in reversed(history.measurements) if s.tick <= end), None)
        if newest is None or sample is None or sample.tick <= newest.tick:
            return False
        return _on_all_feet(sample)

    def _select_peer(
        self, robot: str, history: PeerHistory, last: int, end: int, first_step: int
    ) -> PeerData:
        """The peer's data from step `end` on, from its plans up to step `last`."""
        config, planner, index = self._config, self._config.planner, self._indices[robot]
        usable = [plan for plan in history.plans if plan.step <= last]
        newest = usable[-1] if usable else None
        age = _age(newest, last, first_step)
        status = self._status(history, newest, last, first_step)
        known, du_ini, y_ini = self._window(index, history, usable, last, end)
        du = np.zeros((planner.N, N_FORCES))
        skipped = planner.applied * (end - newest.step) if newest is not None else planner.N
        if newest is not None and skipped < planner.N:
            nominal = nominal_forces(
                horizon_stance(config, index, newest.step), config.robot.weight
            )
            du[: planner.N - skipped] = (newest.u - nominal)[skipped:]
        step = newest.step if newest is not None else None
        return PeerData(robot, index, status, step, max(age, 0), known, du_ini, y_ini, du)

    def _window(
        self, index: int, history: PeerHistory, plans: list[Plan], last: int, end: int
    ) -> tuple[NDArray[np.bool_], Array, Array]:
        """The T_ini samples that end at step `end`: measured, else as the peer planned them."""
        T_ini, weight = self._config.planner.T_ini, self._config.robot.weight
        first_tick = end * step_ms(self._config) - SAMPLE_MS * (T_ini - 1)
        measured: dict[int, Measurement] = {}
        for sample in history.measurements:
            place = (sample.tick - first_tick) // SAMPLE_MS
            if 0 <= place < T_ini and sample.tick <= last * step_ms(self._config):
                measured[place] = sample
        if len(measured) == T_ini:  # as nearly always; they are in the order of their ticks
            return np.ones(T_ini, dtype=np.bool_), *_deviations(measured.values(), weight)
        known = np.zeros(T_ini, dtype=np.bool_)
        du, y = np.zeros((T_ini, N_FORCES)), np.zeros((T_ini, N_OUTPUTS))
        if measured:
            places = list(measured)
            known[places] = True
            du[places], y[places] = _deviations(measured.values(), weight)
        missing = np.flatnonzero(~known)
        ticks = sample_starts(first_tick - SAMPLE_MS, T_ini)[missing]
        nominal = nominal_forces(scheduled_stance(self._config, index, ticks), weight)
        for k, (place, tick) in enumerate(zip(missing.tolist(), ticks.tolist(), strict=True)):
            for plan in reversed(plans):  # the newest that reaches there
                ahead = (tick - plan.tick) // SAMPLE_MS
                if 0 <= ahead < len(plan.u):
                    known[place] = True
                    du[place], y[place] = plan.u[ahead] - nominal[k], plan.y[ahead]
                    break
        return known, du, y


def _newest(history: PeerHistory, last: int) -> Plan | None:
    """A peer's newest plan of steps up to `last`."""
    return next((plan for plan in reversed(history.plans) if plan.step <= last), None)


def _stands(history: PeerHistory) -> bool:
    """Whether a peer stood on all four feet when it was last heard."""
    return _on_all_feet(history.measurements[-1])


def _on_all_feet(sample: Measurement) -> bool:
    return bool((sample.stance > 0.5).all())


def _deviations(samples: Collection[Measurement], weight: float) -> tuple[Array, Array]:
    """Force deviations of samples, (k, 12), N, and their outputs, (k, 6)."""
    stance = np.array([sample.stance for sample in samples]) > 0.5
    du = np.array([sample.u for sample in samples]) - nominal_forces(stance, weight)
    return du, np.array([sample.y for sample in samples])


def _age(newest: Plan | None, last: int, first_step: int) -> int:
    """Steps from a peer's newest plan to `last`; of a peer without a plan from first_step − 1."""
    return last - (first_step - 1 if newest is None else newest.step)
