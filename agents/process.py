"""SHELL of one robot's agent: what it is made of, and its rehearsal before it walks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox
from quadriga.agents.planner.team import Collected
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.agents.rehearsal import rehearse
from quadriga.agents.shell import answer_states
from quadriga.shared.config.endpoints import is_loopback
from quadriga.shared.config.sections import Config
from quadriga.shared.errors import ProcessError
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic_ns, thread_ns
from quadriga.shared.runtime.scheduling import count_cores, end_collection
from quadriga.shared.runtime.signals import stop_on_signals

_TICK_MS: Final = 1.0  # what there is for a tick in real time


def run(
    config: Config,
    robot: str,
    predictor: Predictor | None,
    stopped: Callable[[], bool] | None = None,
    collected: Collected | None = None,
) -> None:
    """Walk one robot until the walk ends or it is stopped.

    `stopped` is asked often whether to stop; by default it is a flag that SIGINT and SIGTERM raise.
    For the others see `Agent`.

    Raises:
        BusError: as `answer_states`.
        ProcessError: as `answer_states`; or this computer cannot keep up in real time.
        KeyboardInterrupt: it is stopped before it is ready.
    """
    stopped = stopped or stop_on_signals()
    use_one_blas_thread()
    agent = Agent(config, robot, predictor, monotonic_ns, collected)

    def rehearse() -> None:
        rehearse_in_time(config, Agent(config, robot, predictor, collected=collected))
        end_collection()

    inbox = Inbox(config, robot, agent.peers)
    sha256 = "" if predictor is None else predictor_sha256(predictor)
    answer_states(config, agent, inbox, stopped, rehearse, sha256)


def rehearse_in_time(config: Config, agent: Agent) -> None:
    """Rehearse; in real time, with `runtime.check_cpu`, refuse a computer that cannot keep up.

    Of a walk in real time the agents are a part only. So a computer that is refused cannot keep up
    for sure; one that is not may still be too slow. The first rehearsal may have compiled
    something, so a second one is measured, in processor time: that of others does not count.

    Raises:
        ProcessError: the processor time of a tick is more than there is for it.
    """
    rehearse(config, agent)
    if config.world.mode != "realtime" or not config.runtime.check_cpu:
        return
    begun = thread_ns()
    ticks = rehearse(config, agent).tick + 1
    cost_ms = 1e-6 * (thread_ns() - begun) / ticks
    agents, cores = config.team.robots if is_loopback(config.bus.endpoint) else 1, count_cores()
    has_ms = _TICK_MS * min(1.0, cores / agents)  # a tick is one thread's work
    if cost_ms > has_ms:
        shared = f"{agents} agents on {cores} cores" if agents > 1 else "one agent"
        raise ProcessError(
            f"{agent.robot} in real time",
            f"{cost_ms:.2f} ms of processor time for a tick",
            f"at most {has_ms:.2f} ms, of {shared}",
            "too slow a computer: --mode lockstep waits for it; runtime.check_cpu = false tries",
        )
