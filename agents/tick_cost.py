"""What a tick costs an agent, measured while it rehearses, and whether a computer has so much.

Of a walk in real time the agents are a part only. So a computer that is refused cannot keep up for
sure; one that is not may still be too slow, which is said while it walks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from quadriga.agents.agent import Agent
from quadriga.agents.rehearsal import rehearse
from quadriga.shared.config.endpoints import is_loopback
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.clock import thread_ns
from quadriga.shared.runtime.scheduling import count_cores

_TICKS: Final = 200  # the last ones of a rehearsal: all that is loaded or compiled has been
_TICK_MS: Final = 1.0  # what there is for a tick in real time


class TickCost:
    """Measures ticks one after the other.

    Args:
        now_ns: processor time so far, ns; that of others, who may be as busy, does not count.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._ends: deque[int] = deque(maxlen=_TICKS + 1)

    def note(self) -> None:
        """A tick is over."""
        self._ends.append(self._now_ns())

    @property
    def mean_ms(self) -> float:
        """Processor time of one of the last ticks; 0.0 before there are two."""
        count = len(self._ends) - 1
        return 1e-6 * (self._ends[-1] - self._ends[0]) / count if count > 0 else 0.0


def check_cost(robot: str, cost_ms: float, agents: int, cores: int) -> None:
    """Refuse a walk in real time that the agents of a computer alone cannot keep up with.

    Args:
        robot: whose agent has measured.
        cost_ms: processor time of a tick.
        agents: that share this computer.
        cores: that they may use.

    Raises:
        ProcessError: they cannot; the message says what a tick costs and what there is for it.
    """
    has = _share_ms(agents, cores)
    if cost_ms <= has:
        return
    shared = f"{agents} agents on {cores} cores" if agents > 1 else "one agent"
    raise ProcessError(
        f"{robot} in real time",
        f"{cost_ms:.2f} ms of processor time for a tick",
        f"at most {has:.2f} ms, of {shared}",
        "too slow a computer: --mode lockstep waits for it; runtime.check_cpu = false tries",
    )


def _share_ms(agents: int, cores: int) -> float:
    """Processor time that there is for a tick of one of some agents: it is one thread's work."""
    return _TICK_MS * min(1.0, cores / agents)


def rehearse_in_time(config: Config, agent: Agent, *, refuse: bool) -> None:
    """Rehearse, and refuse a walk in real time on a computer that cannot keep up.

    A first rehearsal may have compiled what no walk has needed before. So a second one decides.

    Args:
        config: the team's configuration.
        agent: one that does not walk.
        refuse: False of an agent that takes over a robot of a team that walks: there is none other.

    Raises:
        ProcessError: see `check_cost`.
    """
    cost_ms = _measure(config, agent)
    if refuse and config.world.mode == "realtime" and config.runtime.check_cpu:
        agents, cores = config.team.robots if is_loopback(config.bus.endpoint) else 1, count_cores()
        if cost_ms > _share_ms(agents, cores):
            cost_ms = _measure(config, agent)
        check_cost(agent.robot, cost_ms, agents, cores)


def _measure(config: Config, agent: Agent) -> float:
    """Processor time of a tick in a rehearsal, ms."""
    cost = TickCost(thread_ns)
    rehearse(config, agent, cost.note)
    return cost.mean_ms
