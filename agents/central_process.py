"""SHELL of the central planner: receive all measurements, plan, publish every robot's plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np

from quadriga.agents.gait import step_ms
from quadriga.agents.inbox import decode_packet
from quadriga.agents.planner.solver import SOLVED
from quadriga.agents.planner.team import TeamPlanner
from quadriga.agents.planning.central import Central, CentralOutputs, CentralState
from quadriga.agents.planning.interface import REFUSED
from quadriga.agents.planning.references import AHEAD_MS
from quadriga.agents.plausibility import is_within_limits
from quadriga.agents.rehearsal import rehearse_central
from quadriga.shared.bus.discovery import ProcessInfo, join
from quadriga.shared.bus.liveness import Liveness
from quadriga.shared.bus.session import POLL, READY, Bus
from quadriga.shared.codec import encode
from quadriga.shared.codes import code_of
from quadriga.shared.config.sections import Config
from quadriga.shared.config.timing import PEER_TIMEOUT
from quadriga.shared.members import PLANNER
from quadriga.shared.messages import Event, Measurement, Reference, Status
from quadriga.shared.robots.conventions import robot_names
from quadriga.shared.runtime.arithmetic import use_one_blas_thread
from quadriga.shared.runtime.clock import monotonic, monotonic_ns
from quadriga.shared.runtime.scheduling import at_work, end_collection
from quadriga.shared.runtime.signals import interruptible, stop_on_signals
from quadriga.shared.topics import EVENT, MEASUREMENT, PLAN, REFERENCE, STATUS, Topic
from quadriga.shared.topics import REFERENCE_EPOCH_MS as EPOCH_MS


def run(
    config: Config,
    planner: TeamPlanner,
    stopped: Callable[[], bool] | None = None,
    predictor_sha256: str = "",
) -> None:
    """Plan for the whole team until the walk ends or it is stopped.

    `stopped` is asked often whether to stop; by default it is a flag that SIGINT and SIGTERM raise.
    The digest of the predictor is told to the others.

    Raises:
        BusError: the bus cannot be opened, or the team is not complete in time.
        ProcessError: who drives time, or the link to the router, has vanished.
        KeyboardInterrupt: it is stopped before it is ready.
    """
    stopped = stopped or stop_on_signals()
    use_one_blas_thread()
    with Bus.open(config.bus, config.team.name, PLANNER, stopped) as bus:
        shell = _CentralShell(config, Central(config, planner, monotonic_ns), bus)
        if not join(bus, config, stopped, ProcessInfo(bus, config, predictor_sha256)):
            return
        with interruptible(stopped):
            rehearse_central(config, Central(config, planner))
        end_collection()
        with at_work(config.runtime.priority):
            bus.declare(READY)
            shell.work(stopped)


class _CentralShell:
    """The loop around `Central.step`."""

    def __init__(self, config: Config, central: Central, bus: Bus) -> None:
        team, names = config.team.name, robot_names(config.team.robots)
        realtime = config.world.mode == "realtime"
        self._config, self._central, self._bus = config, central, bus
        self._topics: dict[str, tuple[Topic, str]] = {
            **{MEASUREMENT.key(team, name): (MEASUREMENT, name) for name in names},
            REFERENCE.key(team): (REFERENCE, ""),
            EVENT.key(team): (EVENT, ""),
        }
        for key in self._topics:
            bus.subscribe(key)
        keys = {name: PLAN.key(team, name) for name in names} | {"": STATUS.key(team, PLANNER)}
        self._put = {n: bus.publisher(key, waits=not realtime) for n, key in keys.items()}
        self._lead = Liveness(bus, config)
        self._patience = 0.0 if realtime else PEER_TIMEOUT
        self._references: list[Reference] = []
        self._measurements: list[tuple[str, Measurement]] = []
        self._counters: Counter[str] = Counter()
        self._end = -1  # tick for which the end of the walk is announced; −1: for none
        self._tick = 0  # of the last plans

    def work(self, stopped: Callable[[], bool]) -> None:
        """Plan whenever a step is due until the walk is over."""
        state, since = CentralState(), monotonic()
        while not (stopped() or self._lead.is_over(announced=self._end >= 0)):
            packet = self._bus.get(POLL)
            if packet is None:
                self._lead.poll(self._tick)
            else:
                self._lead.receive()
                for key, payload in (packet, *self._bus.drain()):
                    self._take(key, payload)
            state = self._central.remember(state, self._measurements, self._references)
            self._measurements, self._references = [], []
            due = self._central.due(state)
            if due is None:
                since = monotonic()
            elif self._reference_known(state, due) or monotonic() - since > self._patience:
                state, outputs = self._central.step(state)
                self._tick = state.step * step_ms(self._config)
                self._publish(state, outputs)

    def _reference_known(self, state: CentralState, step: int) -> bool:
        """Whether the operator's reference for the time of `step` has arrived."""
        tick = step * step_ms(self._config)
        known = state.references
        return bool(known) and known[-1].tick >= tick - tick % EPOCH_MS

    def _take(self, key: str, payload: bytes) -> None:
        topic, robot = self._topics[key]
        message = decode_packet(topic, payload)
        if isinstance(message, Measurement):
            self._measurements.append((robot, message))
            if message.tick > self._end:
                self._end = -1
        elif isinstance(message, Event):
            if message.kind == "stop":
                self._end = min(message.tick, self._tick + AHEAD_MS)
        elif isinstance(message, Reference) and is_within_limits(message):
            self._references.append(message)
        else:
            self._counters[f"dropped_{topic.name}"] += 1

    def _publish(self, state: CentralState, outputs: CentralOutputs) -> None:
        for name, plan in outputs.plans:
            self._put[name](encode(plan))
        if not outputs.plans or outputs.planner_ns is None:
            return
        plan = outputs.plans[0][1]
        if plan.status != SOLVED:
            self._counters[f"plan_{code_of(plan.status)}"] += 1
        if state.refused:
            self._counters[REFUSED] = state.refused
        took, counters = np.array([1e-6 * outputs.planner_ns]), dict(self._counters)
        status = Status(plan.tick, plan.stamp_ns, "plan", "", "", {}, counters, took, np.zeros(0))
        self._put[""](encode(status))
