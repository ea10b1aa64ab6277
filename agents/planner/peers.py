"""Which of its peers' messages an agent uses at step k, and what they add to its prediction.

At step k each peer's plan and T_ini window of step k−1 are used (eq. 11), never those of step k,
unless the agents answer each other within a step (`planner.exchanges`).
Pure: messages in, selection out; lost, repeated, late and foreign messages are all accounted for.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadriga.agents.gait import (
    horizon_stance,
    nominal_forces,
    patience,
    phase_of,
    place_in,
    sample_starts,
    scheduled_stance,
    step_ms,
    walking_steps,
)
from quadriga.agents.planner.cooperation import (
    brings_forward,
    is_cooperative,
    peer_slope,
    team_slope,
)
from quadriga.agents.planner.qp import stance_columns
from quadriga.agents.plausibility import is_plausible
from quadriga.agents.predictor.predictor import Predictor
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Message, Plan
from quadriga.shared.robots.conventions import N_FORCES, N_OUTPUTS, Array, robot_names
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import MEASUREMENT, SAMPLE_MS

USABLE: Final = "usable"  # the newest plan that may be used, shifted by its age
SILENT: Final = "silent"  # that plan is too old: the peer counts as doing nothing
LOST: Final = "lost"  # silent for too long, or the peer has stopped: the team stops

M = TypeVar("M", bound=Measurement | Plan)


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
    """One peer's part of eq. 11 at a planning step.

    Attributes:
        robot: the peer's name.
        index: its place in the team, 0-based.
        status: usable, silent or lost; only the arrays of a usable peer are of use.
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


@record
class PeerTerms:
    """Effect of the peers on an agent's outputs at one planning step (eq. 11).

    Attributes:
        effect: Σ G_ij [u_ini; y_ini; u] over the peers, (6 N,).
        slope: Σ M_ij [u_ini; y_ini; u] over the peers, what they add to the slope of the team's
            cost by own stance forces, (nv,); 0 where each agent has its own cost.
        peers: what this is made of.
    """

    effect: Array | float = 0.0
    slope: Array | float = 0.0
    peers: tuple[PeerData, ...] = ()

    @property
    def used(self) -> dict[str, int]:
        """Step of the plan used, by peer; peers that never planned are left out."""
        return {peer.robot: peer.step for peer in self.peers if peer.step is not None}

    @property
    def lost(self) -> tuple[str, ...]:
        """Names of the peers given up; the agent stops if there are any."""
        return tuple(peer.robot for peer in self.peers if peer.status == LOST)


class Neighbours:
    """The delay protocol of agent `index`, 0-based; holds no state beyond its configuration.

    `peers` are the places of the robots that matter to it, None: all others; `names` their names.
    """

    def __init__(self, config: Config, index: int, peers: frozenset[int] | None = None) -> None:
        self._config, self._step_ms = config, step_ms(config)
        self._indices = {
            name: j
            for j, name in enumerate(robot_names(config.team.robots))
            if (j != index if peers is None else j in peers)
        }
        self.names = tuple(self._indices)
        # Messages are kept back to the window of the oldest plan that may be used.
        steps = patience(config) + 2
        self._span_ms = SAMPLE_MS * config.planner.T_ini + self._step_ms * steps

    def initial(self) -> PeerMemory:
        """The memory before the first message."""
        return PeerMemory(dict.fromkeys(self._indices, PeerHistory()))

    def remember(
        self,
        memory: PeerMemory,
        tick: int,
        measurements: Iterable[tuple[str, Measurement]] = (),
        plans: Iterable[tuple[str, Plan]] = (),
    ) -> PeerMemory:
        """Add messages that have arrived by world time `tick`; forget what is too old to matter.

        The order of arrival does not matter. A message is refused and counted if it is a second one
        for the same tick or step, comes from a robot that is no peer, is off the time grid or from
        the future, is a plan of another horizon, or has implausible numbers (`is_plausible`).
        """
        peers, refused, oldest = dict(memory.peers), memory.refused, tick - self._span_ms
        arrived: list[tuple[str, Measurement | Plan]] = [*measurements, *plans]
        for robot, message in arrived:
            history = peers.get(robot)
            if history is None or not self._is_usable(message, tick):
                refused += 1
                continue
            samples, made = history.measurements, history.plans
            if isinstance(message, Plan):
                made = _insert(made, message, oldest)
            else:
                samples = _insert(samples, message, oldest)
            refused += made is history.plans and samples is history.measurements
            peers[robot] = PeerHistory(samples, made)
        return PeerMemory(peers, refused)

    def _is_usable(self, message: Measurement | Plan, now: int) -> bool:
        """Whether a message is of this time and grid, and has numbers that a robot can mean.

        A peer's clock may lead by a little; messages far ahead would push out all real ones.
        """
        tick = message.tick
        if isinstance(message, Plan):
            of_step = message.step * self._step_ms == tick
            on_grid = of_step and len(message.u) == self._config.planner.N
        else:
            on_grid = tick % SAMPLE_MS == 0
        timely = now - self._span_ms <= tick <= now + self._step_ms
        return timely and on_grid and is_plausible(self._config, message.u, message.y)

    def are_ready(self, memory: PeerMemory, tick: int) -> bool:
        """Whether the samples of all peers come at `tick`, and each stands or plans."""
        recent = tick - patience(self._config) * self._step_ms
        return all(
            history.measurements
            and tick - history.measurements[-1].tick <= MEASUREMENT.max_age_ms
            and (
                _stands(history.measurements[-1])
                or (history.plans and history.plans[-1].tick >= recent)
            )
            for history in memory.peers.values()
        )

    def is_complete(self, memory: PeerMemory, serial: tuple[int, int]) -> bool:
        """Whether every peer's plan of this `Plan.serial` is there, and its window before it."""
        end = serial[0] * self._step_ms
        return all(
            history.plans
            and history.plans[-1].serial >= serial
            and history.measurements
            and history.measurements[-1].tick >= end
            for history in memory.peers.values()
        )

    def lost_peers(self, memory: PeerMemory, last: int, first_step: int) -> tuple[str, ...]:
        """Names of the peers given up, those that `select` would call lost."""
        return tuple(
            name
            for name, history in memory.peers.items()
            if self._judge(history, last, first_step)[0] == LOST
        )

    def select(
        self, memory: PeerMemory, last: int, first_step: int, end: int
    ) -> tuple[PeerData, ...]:
        """Choose the plan and the window of each peer that a planning step uses.

        Before its first plan has arrived a peer is assumed to have planned no deviation at step
        first_step − 1, so that the first planning step needs nobody's plan.

        Args:
            memory: what has been remembered.
            last: newest step whose plans and samples are looked at; with the one-step delay k−1.
            first_step: the first planning step of the team, or since it walks again.
            end: planning step at which the windows end: `last`, as in eq. 11, or a later one, which
                moves windows and plans forward and takes samples not measured yet from the plans.
        """
        config, planner, peers = self._config, self._config.planner, []
        for name, index in self._indices.items():
            history = memory.peers[name]
            status, age, plans = self._judge(history, last, first_step)
            window = self._window(index, history.measurements, plans, last, end)
            du, step = np.zeros((planner.N, N_FORCES)), None
            if plans:
                step = plans[-1].step
                nominal = nominal_forces(horizon_stance(config, index, step), config.robot.weight)
                rest = (plans[-1].u - nominal)[planner.applied * (end - step) :]
                du[: len(rest)] = rest
            peers.append(PeerData(name, index, status, step, max(age, 0), *window, du))
        return tuple(peers)

    def _judge(
        self, history: PeerHistory, last: int, first_step: int
    ) -> tuple[str, int, tuple[Plan, ...]]:
        """Status of a peer at step `last`, the age of its newest plan, and its plans until then."""
        oldest = first_step - patience(self._config)  # what is older was made before a stop
        plans = tuple(plan for plan in history.plans if oldest <= plan.step <= last)
        age, end = last - (plans[-1].step if plans else first_step - 1), last * self._step_ms
        newest = [sample for sample in history.measurements if sample.tick <= end][-1:]
        # A peer that has come to stand since its newest plan makes none any more.
        stopped = plans and newest and newest[0].tick > plans[-1].tick and _stands(newest[0])
        if age > patience(self._config) or stopped:
            return LOST, age, plans
        return SILENT if age > self._config.planner.max_peer_age else USABLE, age, plans

    def _window(
        self,
        index: int,
        samples: tuple[Measurement, ...],
        plans: tuple[Plan, ...],
        last: int,
        end: int,
    ) -> tuple[NDArray[np.bool_], Array, Array]:
        """The T_ini samples that end at step `end`: measured, else as the peer planned them."""
        T_ini, weight = self._config.planner.T_ini, self._config.robot.weight
        starts = sample_starts(end * self._step_ms - SAMPLE_MS * T_ini, T_ini)
        newest = last * self._step_ms
        measured = {sample.tick - SAMPLE_MS: sample for sample in samples if sample.tick <= newest}
        stance = scheduled_stance(self._config, index, starts)
        known = np.zeros(T_ini, dtype=np.bool_)
        u, y = np.zeros((T_ini, N_FORCES)), np.zeros((T_ini, N_OUTPUTS))
        for k, start in enumerate(starts.tolist()):
            if (sample := measured.get(start)) is not None:
                known[k], stance[k], u[k], y[k] = True, sample.stance > 0.5, sample.u, sample.y
                continue
            for plan in plans:  # the newest that has this sample counts
                ahead = (start - plan.tick) // SAMPLE_MS
                if 0 <= ahead < len(plan.u):
                    known[k], u[k], y[k] = True, plan.u[ahead], plan.y[ahead]
        du = u - nominal_forces(stance, weight)
        du[~known] = 0.0
        return known, du, y


def _stands(sample: Measurement) -> bool:
    """Whether a peer stands on all four feet."""
    return bool((sample.stance > 0.5).all())


def order_of(message: Message) -> tuple[int, int]:
    """Where a message stands among those of its source: by tick, or by step and exchange."""
    return message.serial if isinstance(message, Plan) else (message.tick, 0)


def _insert(held: tuple[M, ...], new: M, oldest: int) -> tuple[M, ...]:
    """`held` with `new` sorted in, without what is older; `held` itself if it has `new` already."""
    place = bisect_left(held, order_of(new), key=order_of)
    if place < len(held) and order_of(held[place]) == order_of(new):
        return held
    kept = [item for item in held[:place] if item.tick >= oldest]
    return (*kept, new, *held[place:])


class Peers:
    """How its peers act on agent `index`, 0-based; functions of their arguments alone.

    A swinging leg of a peer carries no force: its columns of G, a third of all, are left out, which
    is exact. Single precision changes an effect by 3e-7 of its size and halves the memory that is
    read.
    """

    def __init__(self, config: Config, index: int, predictor: Predictor) -> None:
        self._config, self._index, self._predictor = config, index, predictor
        self._others = [j for j in range(config.team.robots) if j != index]
        self._coupling = cache(self._build_coupling)  # of two steps of the gait's cycle
        self._cycle = walking_steps(config)
        self._cooperative = is_cooperative(config)
        behind = {0 if brings_forward(config) else 1}
        if config.planner.exchanges:
            behind.add(0)
        # The cycle's first step is set up twice: later its plans also begin at a step of the walk.
        for step in (*self._cycle, self._cycle.stop):
            for steps in behind:
                self._coupling(*self._places(step, step - steps))

    def terms(
        self, peers: tuple[PeerData, ...], step: int, window_step: int, y_base: Array
    ) -> PeerTerms:
        """The terms of eq. 11 of the peers of `Neighbours.select` for planning step `step`.

        Their windows end at `window_step`; `y_base` is the base of the outputs at the ends of the
        windows' samples, (T_ini, 6).
        """
        if not peers:
            return PeerTerms()
        z = np.zeros((len(self._others), self._predictor.layout.width), dtype=np.float32)
        for peer in peers:
            if peer.status == USABLE:
                dy = np.where(peer.known[:, None], peer.y_ini - y_base, 0.0)
                z[peer.index - (peer.index > self._index)] = np.concatenate(
                    [peer.du_ini.ravel(), dy.ravel(), peer.du.ravel()]
                )
        columns, rows = self._coupling(*self._places(step, window_step))
        total = (rows @ z.ravel()[columns]).astype(np.float64)
        outputs = N_OUTPUTS * self._config.planner.N
        slope = total[outputs:] if self._cooperative else 0.0
        return PeerTerms(total[:outputs], slope, peers)

    def _places(self, *steps: int) -> tuple[int, ...]:
        return tuple(place_in(self._cycle, step) for step in steps)

    def _build_coupling(
        self, step: int, window_step: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Of all peers' z at a step, whose plans begin at `window_step`: places, and rows of G.

        With the team's cost those are the rows of [G_ij; M_ij].
        """
        config, index, predictor = self._config, self._index, self._predictor
        phase = phase_of(config, step, predictor.phases)
        blocks = [predictor.block(index, j, phase) for j in self._others]
        if self._cooperative:
            slopes = team_slope(config, predictor, index, step)
            rows = [peer_slope(slopes, predictor, j, phase) for j in self._others]
            blocks = [np.concatenate(pair) for pair in zip(blocks, rows, strict=True)]
        return couple(blocks, [horizon_stance(config, j, window_step) for j in self._others])


def couple(
    G: Sequence[Array] | Array, stance: Sequence[NDArray[np.bool_]]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Places, (c,), in all peers' z = [u_ini; y_ini; u], and the columns of G there, (rows, c).

    G is (rows, 18 T_ini + 12 N) of each peer, its stance over its plan (N, 4).
    """
    columns, rows = [np.zeros(0, dtype=np.int64)], [np.zeros((len(G[0]) if len(G) else 0, 0))]
    for i, (block, legs) in enumerate(zip(G, stance, strict=True)):
        past = block.shape[1] - 3 * legs.size
        kept = np.concatenate([np.arange(past), past + stance_columns(legs)])
        columns.append(i * block.shape[1] + kept)
        rows.append(block[:, kept])
    G_kept = np.ascontiguousarray(np.concatenate(rows, axis=1), dtype=np.float32)
    return np.concatenate(columns), G_kept
