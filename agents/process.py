"""SHELL of one robot's agent: what it is made of, and its rehearsal before it walks."""

from __future__ import annotations

from collections.abc import Callable

from quadriga.agents.agent import Agent
from quadriga.agents.inbox.inbox import Inbox
from quadriga.agents.planner.team import Collected
from quadriga.agents.predictor.predictor import Predictor
from quadriga.agents.predictor.store import predictor_sha256
from quadriga.agents.shell import answer_states
from quadriga.agents.tick_cost import rehearse_in_time
from quadriga.shared.bus.discovery import STARTS
from quadriga.shared.config.sections import Config
from quadriga.shared.runtime.blas import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic_ns
from quadriga.shared.runtime.collector import end_collection
from quadriga.shared.runtime.signals import stop_on_signals


def run(
    config: Config,
    robot: str,
    predictor: Predictor | None,
    stopped: Callable[[], bool] | None = None,
    collected: Collected | None = None,
) -> None:
    """Walk one robot until the walk ends or it is stopped.

    In real time an agent that is started while its team walks takes its robot over: it gets it up
    where it is.

    Args:
        config: the team's configuration.
        robot: the robot's name, r1 … rn.
        predictor: the fitted predictor; None walks on nominal forces.
        stopped: asked often whether to stop; by default a flag that SIGINT and SIGTERM raise.
        collected: reads the collected episodes, for agents that plan with them.

    Raises:
        BusError: as `answer_states`.
        ProcessError: as `answer_states`; or this computer cannot keep up in real time.
        KeyboardInterrupt: it is stopped before it is ready.
    """
    stopped = stopped or stop_on_signals()
    use_one_blas_thread()
    agent = Agent(config, robot, predictor, monotonic_ns, collected)

    def rehearse(joined: str) -> None:
        rehearsed = Agent(config, robot, predictor, collected=collected)
        rehearse_in_time(config, rehearsed, refuse=joined == STARTS)
        end_collection()

    inbox = Inbox(config, robot, agent.peers)
    sha256 = "" if predictor is None else predictor_sha256(predictor)
    answer_states(config, agent, inbox, stopped, rehearse, sha256)
