"""What an agent remembers of its peers' messages, and which messages it refuses."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from quadriga.agents.plausibility import is_plausible
from quadriga.agents.time_grid import patience, step_ms
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Message, Plan
from quadriga.shared.runtime.record import record
from quadriga.shared.topics import SAMPLE_MS

M = TypeVar("M", bound=Message)
K = TypeVar("K", int, tuple[int, int])


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


def remember(
    config: Config,
    memory: PeerMemory,
    tick: int,
    measurements: Iterable[tuple[str, Measurement]] = (),
    plans: Iterable[tuple[str, Plan]] = (),
) -> PeerMemory:
    """Add messages that have arrived by world time `tick`; forget what is too old to matter.

    The order of arrival does not matter. A message is refused and counted if it is a second one for
    the same tick or step, comes from a robot that is no peer, is off the time grid or from the
    future, is a plan of another horizon, or has implausible numbers (`is_plausible`).
    """
    peers, refused = dict(memory.peers), memory.refused
    oldest = tick - _span_ms(config)
    for robot, measurement in measurements:
        history = peers.get(robot)
        extended = None
        if history is not None and _is_usable_measurement(config, measurement, tick):
            extended = _insert(history.measurements, measurement, oldest, _by_tick)
        if history is None or extended is None:
            refused += 1
        else:
            peers[robot] = PeerHistory(extended, history.plans)
    for robot, plan in plans:
        history = peers.get(robot)
        kept_plans = None
        if history is not None and _is_usable_plan(config, plan, tick):
            kept_plans = _insert(history.plans, plan, (oldest // step_ms(config), 0), _by_serial)
        if history is None or kept_plans is None:
            refused += 1
        else:
            peers[robot] = PeerHistory(history.measurements, kept_plans)
    return PeerMemory(peers, refused)


def _is_usable_measurement(config: Config, measurement: Measurement, now: int) -> bool:
    if not _is_on_grid(config, measurement.tick, SAMPLE_MS, now):
        return False
    return is_plausible(config, measurement.u, measurement.y)


def _is_usable_plan(config: Config, plan: Plan, now: int) -> bool:
    if not _is_on_grid(config, plan.tick, step_ms(config), now):
        return False
    if plan.step * step_ms(config) != plan.tick or len(plan.u) != config.planner.N:
        return False
    return is_plausible(config, plan.u, plan.y)


def _is_on_grid(config: Config, tick: int, grid_ms: int, now: int) -> bool:
    """Whether `tick` is one of the grid, neither too old nor ahead of all peers' clocks.

    A peer's clock may lead by a little; messages far ahead would push out all real ones.
    """
    return tick % grid_ms == 0 and now - _span_ms(config) <= tick <= now + step_ms(config)


def _span_ms(config: Config) -> int:
    """How long messages are kept, ms: back to the window of the oldest plan that may be used."""
    return SAMPLE_MS * config.planner.T_ini + step_ms(config) * (patience(config) + 2)


def _by_tick(measurement: Measurement) -> int:
    return measurement.tick


def _by_serial(plan: Plan) -> tuple[int, int]:
    return plan.serial


def _insert(
    held: tuple[M, ...], new: M, oldest: K, order: Callable[[M], K]
) -> tuple[M, ...] | None:
    """`held` with `new` sorted in, without items before `oldest`; None if it has `new` already."""
    place: int = len(held)
    if held and order(held[-1]) >= order(new):  # it is not the newest, as nearly all are
        place = bisect_left(held, order(new), key=order)
        if order(held[place]) == order(new):
            return None
    start: int = 0
    while start < len(held) and order(held[start]) < oldest:  # one at a time gets too old
        start += 1
    return (*held[start:place], new, *held[place:])
