"""The one-step communication delay: which of its peers' messages an agent uses at step k.

At step k each peer's plan and T_ini window of step k−1 are used (eq. 11), never those of step k,
unless the agents answer each other within a step (`planner.exchanges`).
Pure: messages in, selection out; lost, repeated, late and foreign messages are all accounted for.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import nominal_forces, scheduled_stance
from quadriga.agents.plausibility import is_plausible
from quadriga.agents.time_grid import horizon_stance, patience, sample_starts, step_ms
from quadriga.shared.config.sections import Config
from quadriga.shared.robot.a1 import N_FORCES, N_OUTPUTS, Array, robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.wire.messages import Measurement, Message, Plan
from quadriga.shared.wire.topics import SAMPLE_MS

M = TypeVar("M", bound=Message)
K = TypeVar("K", int, tuple[int, int])

FRESH: Final = "fresh"  # the newest plan that may be used: that of step k−1
SHIFTED: Final = "shifted"  # an older one, shifted by its age
HELD: Final = "held"  # too old: the effect of the peer's last terms stays in force
LOST: Final = "lost"  # held long enough: the team stops


@record
class PeerHistory:
    """What is remembered of one peer: measurements by tick and plans by step, both ascending."""

    measurements: tuple[Measurement, ...] = ()
    plans: tuple[Plan, ...] = ()


@record
class PeerMemory:
    """Recent messages of all peers by name, and how many were refused."""

    peers: Mapping[str, PeerHistory]
    refused: int = 0


@record
class PeerData:
    """One peer's part of eq. 11 at planning step k, its window ending at step k−1 (or as told).

    Attributes:
        robot: the peer's name.
        index: its place in the team, 0-based.
        status: fresh, shifted, held or lost; held and lost carry no arrays worth using.
        step: step of the plan used, or None while the peer has never planned.
        age: how many steps older than that of the newest plan allowed it is.
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
class Selection:
    """Everything an agent takes from its peers at one planning step.

    Attributes:
        peers: each peer's part.
        window_step: planning step at which the peers' windows end.
    """

    peers: tuple[PeerData, ...] = ()
    window_step: int = 0

    @property
    def used(self) -> dict[str, int]:
        """For each peer the step of the plan consumed; peers that never planned are left out."""
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
        kept_steps = patience(config) + 2
        self._span_ms = SAMPLE_MS * config.planner.T_ini + step_ms(config) * kept_steps

    def initial(self) -> PeerMemory:
        """No messages yet."""
        return PeerMemory({name: PeerHistory() for name in self._indices})

    def remember(
        self,
        memory: PeerMemory,
        tick: int,
        measurements: Iterable[tuple[str, Measurement]] = (),
        plans: Iterable[tuple[str, Plan]] = (),
    ) -> PeerMemory:
        """Add messages that have arrived by world time `tick`; forget what is too old to matter.

        The order of arrival does not matter. A second message for the same tick or step, one of
        a robot that is no peer, one off the time grid or from the future, a plan of another
        horizon and numbers that no robot can mean (`is_plausible`) are refused and counted.
        """
        peers, refused = dict(memory.peers), memory.refused
        for robot, measurement in measurements:
            history = peers.get(robot)
            kept = None
            if (
                history is not None
                and self._on_grid(measurement.tick, SAMPLE_MS, tick)
                and is_plausible(self._config.planner, measurement.u, measurement.y)
            ):
                oldest = tick - self._span_ms
                kept = _inserted(history.measurements, measurement, oldest, _by_tick)
            if history is None or kept is None:
                refused += 1
            else:
                peers[robot] = replace(history, measurements=kept)
        for robot, plan in plans:
            history = peers.get(robot)
            kept_plans = None
            if (
                history is not None
                and self._on_grid(plan.tick, step_ms(self._config), tick)
                and plan.step * step_ms(self._config) == plan.tick
                and len(plan.u) == self._config.planner.N
                and is_plausible(self._config.planner, plan.u, plan.y)
            ):
                oldest = (tick - self._span_ms) // step_ms(self._config)
                kept_plans = _inserted(history.plans, plan, (oldest, 0), _by_serial)
            if history is None or kept_plans is None:
                refused += 1
            else:
                peers[robot] = replace(history, plans=kept_plans)
        return PeerMemory(peers, refused)

    def _on_grid(self, of: int, grid_ms: int, now: int) -> bool:
        # A peer's clock may lead by a little; one far ahead would push out all that is real.
        return of % grid_ms == 0 and now - self._span_ms <= of <= now + step_ms(self._config)

    def complete(self, memory: PeerMemory, serial: tuple[int, int]) -> bool:
        """Whether every peer's plan of this step and exchange is there, and its window before it.

        Args:
            memory: what has been remembered.
            serial: step and exchange, see `Plan.serial`.
        """
        end = serial[0] * step_ms(self._config)
        return all(
            bool(history.plans and history.plans[-1].serial >= serial)
            and bool(history.measurements and history.measurements[-1].tick >= end)
            for history in memory.peers.values()
        )

    def select(
        self, memory: PeerMemory, last: int, first_step: int, *, window_step: int | None = None
    ) -> Selection:
        """What to use of each peer.

        Before its first plan has arrived a peer is taken to have planned no deviation at step
        first_step − 1, so that the first planning step needs nobody's plan.

        Args:
            memory: what has been remembered.
            last: newest step whose plans and samples are looked at; with the one-step delay k−1.
            first_step: the team's first planning step.
            window_step: where the windows shall end; `last` is as in eq. 11, a later one brings
                windows and plans forward, samples not measured yet taken from the plans.
        """
        end = last if window_step is None else window_step
        peers = [
            self._of(name, memory.peers[name], last, end, first_step) for name in self._indices
        ]
        return Selection(tuple(peers), end)

    def lost(self, memory: PeerMemory, last: int, first_step: int) -> tuple[str, ...]:
        """Names of the peers given up, those that `select` would call lost."""
        newest = {
            name: next((plan for plan in reversed(history.plans) if plan.step <= last), None)
            for name, history in memory.peers.items()
        }
        return tuple(
            name
            for name, plan in newest.items()
            if self._status(_age(plan, last, first_step)) == LOST
        )

    def _status(self, age: int) -> str:
        """What becomes of a peer whose plan is `age` steps older than the newest one allowed."""
        if age > patience(self._config):
            return LOST
        if age > self._config.planner.max_peer_age:
            return HELD
        return FRESH if age <= 0 else SHIFTED

    def _of(
        self, robot: str, history: PeerHistory, last: int, end: int, first_step: int
    ) -> PeerData:
        """The peer's data, plans up to step `last`, from step `end` on."""
        config, planner, index = self._config, self._config.planner, self._indices[robot]
        usable = [plan for plan in history.plans if plan.step <= last]
        newest = usable[-1] if usable else None
        age = _age(newest, last, first_step)
        status = self._status(age)
        known, du_ini, y_ini = self._window(index, history, usable, last, end)
        du = np.zeros((planner.N, N_FORCES))
        skipped = planner.applied * (end - newest.step) if newest is not None else planner.N
        if newest is not None and skipped < planner.N:
            nominal = nominal_forces(horizon_stance(config, index, newest.step))
            du[: planner.N - skipped] = (newest.u - nominal)[skipped:]
        step = newest.step if newest is not None else None
        return PeerData(robot, index, status, step, max(age, 0), known, du_ini, y_ini, du)

    def _window(
        self, index: int, history: PeerHistory, plans: list[Plan], last: int, end: int
    ) -> tuple[NDArray[np.bool_], Array, Array]:
        """The T_ini samples that end at step `end`: measured, else as the peer planned them."""
        T_ini = self._config.planner.T_ini
        first_tick = end * step_ms(self._config) - SAMPLE_MS * (T_ini - 1)
        known = np.zeros(T_ini, dtype=np.bool_)
        du, y = np.zeros((T_ini, N_FORCES)), np.zeros((T_ini, N_OUTPUTS))
        measured = {
            place: sample
            for sample in history.measurements
            if sample.tick <= last * step_ms(self._config)
            and 0 <= (place := (sample.tick - first_tick) // SAMPLE_MS) < T_ini
        }
        if len(measured) < T_ini:
            ticks = sample_starts(first_tick - SAMPLE_MS, T_ini)
            nominal = nominal_forces(scheduled_stance(self._config, index, ticks))
            for plan in plans:  # ascending: the newest plan of a sample has the last word
                ahead = (ticks - plan.tick) // SAMPLE_MS
                covered = (ahead >= 0) & (ahead < len(plan.u))
                known |= covered
                du[covered] = plan.u[ahead[covered]] - nominal[covered]
                y[covered] = plan.y[ahead[covered]]
        if measured:
            places = list(measured)
            samples = list(measured.values())
            known[places] = True
            stance = np.array([sample.stance for sample in samples]) > 0.5
            du[places] = np.array([sample.u for sample in samples]) - nominal_forces(stance)
            y[places] = [sample.y for sample in samples]
        return known, du, y


def _age(newest: Plan | None, last: int, first_step: int) -> int:
    """Steps from a peer's newest plan to `last`; before its first one from the last without any."""
    return last - (first_step - 1 if newest is None else newest.step)


def _by_tick(measurement: Measurement) -> int:
    return measurement.tick


def _by_serial(plan: Plan) -> tuple[int, int]:
    return plan.serial


def _inserted(
    held: tuple[M, ...], new: M, oldest: K, order: Callable[[M], K]
) -> tuple[M, ...] | None:
    """`held` with `new` in its place and without what is older; None if it is there already."""
    place: int = bisect_left(held, order(new), key=order)
    if place < len(held) and order(held[place]) == order(new):
        return None
    start: int = bisect_left(held, oldest, key=order)
    return (*held[start:place], new, *held[place:])
