"""Whatever an agent had taken in when, the recording hands it over at the same steps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadriga.agents.agent import Agent
from quadriga.agents.inbox import Inbox, Order, Source, format_message_id, list_messages, order_of
from quadriga.agents.predictor.predictor import Predictor, PredictorMeta
from quadriga.replay.agent_log import AgentLog
from quadriga.replay.recorded_inputs import RecordedInputs, StepInputs
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.config.sections import Config
from quadriga.shared.messages import Measurement, Message, Plan, Reference
from tests.a1 import standing

TICKS, STEP_MS, PATIENCE = 420, 40, 30
Taken = list[tuple[int, list[tuple[Source, Order]]]]


def agent_of(mode: str) -> tuple[Config, Agent]:
    """Robot r2 of three, with a predictor that predicts nothing."""
    config = load(None, {"team.robots": 3, "world.mode": mode, "gait.stand_ms": 100})
    meta = PredictorMeta.of(config)
    nothing = Predictor(meta, np.zeros((1, 3, 3, 6 * meta.N, meta.layout.width)))
    return config, Agent(config, "r2", nothing)


AGENTS = {mode: agent_of(mode) for mode in ("lockstep", "realtime")}


def sent(config: Config) -> list[tuple[int, str, Source, Message]]:
    """What others send: tick, key, source, message."""
    found: list[tuple[int, str, Source, Message]] = []
    for tick in range(0, TICKS, 10):
        for peer in ("r1", "r3"):
            if tick:
                sample = Measurement(tick, tick, np.zeros(12), np.zeros(6), np.ones(4))
                found.append((tick, f"team/{peer}/measurement", ("measurement", peer), sample))
            if tick % STEP_MS == 0 and tick >= 160:
                plan = Plan(
                    tick,
                    tick,
                    tick // STEP_MS,
                    np.zeros((25, 12)),
                    np.zeros((25, 6)),
                    "solved",
                    {},
                    0,
                )
                found.append((tick, f"team/{peer}/plan", ("plan", peer), plan))
        if tick % 100 == 0:
            reference = Reference(tick, tick, 0.1, 0.0, 0.0, 0.26)
            found.append((tick, "team/reference", ("reference", "operator"), reference))
    return found


def forged(of: int) -> list[tuple[str, Source, Message]]:
    """Key, source, message of what nobody sends by rule, of a time."""
    sample = Measurement(of, of, np.zeros(12), np.zeros(6), np.zeros(4))
    horizon = np.zeros((25, 12)), np.zeros((25, 6))
    return [
        ("team/reference", ("reference", "operator"), Reference(of, of, 0.2, 0.0, 0.0, 0.26)),
        ("team/r1/measurement", ("measurement", "r1"), sample),
        ("team/r3/plan", ("plan", "r3"), Plan(of, of, of // STEP_MS, *horizon, "", {}, 1)),
    ]


@dataclass
class Traffic:
    """What others send, with the tick at which it arrives; all of it is recorded."""

    log: AgentLog
    pending: list[tuple[int, str, Source, Message]] = field(default_factory=list)

    def send(self, arrival: int, key: str, source: Source, message: Message) -> None:
        self.pending.append((arrival, key, source, message))
        self.log.received[source][order_of(message)].append((key, encode(message)))

    def deliver(self, inbox: Inbox, until: int, of: frozenset[Source] | None = None) -> None:
        for item in sorted(self.pending, key=lambda item: item[0]):
            if item[0] <= until and (of is None or item[2] in of):
                inbox.take(item[1], encode(item[3]))
                self.pending.remove(item)


def send_all(
    traffic: Traffic,
    config: Config,
    delay: Callable[[], int],
    second: Sequence[tuple[int, int]],
    early: Sequence[tuple[int, int]],
) -> None:
    arrivals: Counter[Source] = Counter()
    for tick, key, source, message in sent(config):
        arrivals[source] = max(arrivals[source], tick + delay())  # a key keeps its order
        traffic.send(arrivals[source], key, source, message)
    for tick, after in second:
        source, message = ("reference", "operator"), Reference(tick, tick, 0.2, 0.0, 0.0, 0.26)
        traffic.send(tick + after, "team/reference", source, message)
    for arrival, lead in early:
        for key, source, message in forged(arrival + lead):
            traffic.send(arrival, key, source, message)


def simulate_walk(
    mode: str,
    seed: int,
    late: float,
    skipped: float,
    second: Sequence[tuple[int, int]] = (),
    early: Sequence[tuple[int, int]] = (),
) -> tuple[AgentLog, Taken]:
    """A walk in which messages come late or never and states are passed over; its recording.

    Args:
        mode: lockstep or realtime.
        seed: of the delays.
        late: share of messages that come late or never.
        skipped: share of states passed over.
        second: tick and delay of references that a second operator sends beside the first.
        early: when somebody sends messages of all kinds, and how far ahead of it, ms.
    """
    rng = np.random.default_rng(seed)
    config, agent = AGENTS[mode]
    inbox, log = Inbox(config, "r2", agent.peers), AgentLog()
    traffic = Traffic(log)

    def delay() -> int:
        return 1 + (int(rng.integers(200)) if rng.random() < late else 0)

    send_all(traffic, config, delay, second, early)
    taken: Taken = []
    last = -1
    for tick in range(TICKS):
        log.states[tick].append(encode(standing(tick)))
        if rng.random() < skipped:
            continue
        awaited = agent.expected(tick)
        inbox.take("team/r2/state", log.states[tick][0])
        traffic.deliver(inbox, tick)
        if mode == "lockstep":
            traffic.deliver(inbox, tick + PATIENCE, inbox.missing_sources(tick, awaited))
        state = inbox.pop_state()
        assert state is not None
        inputs = inbox.pop_inputs(state, awaited)
        record = inbox.record(last, inputs, awaited)
        if record is not None:
            log.records[tick] = record
        last = log.last = tick
        taken.append((tick, list_messages(inputs)))
    for peer in agent.peers:
        log.peers_awake[peer].update(range(0, TICKS, 10))
    return log, taken


def handed_over(mode: str, log: AgentLog) -> list[StepInputs]:
    """What a replay hands over."""
    config, agent = AGENTS[mode]
    return list(RecordedInputs(config, agent, Inbox(config, "r2", agent.peers), log).steps())


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
@settings(max_examples=40)
@given(
    seed=st.integers(0, 1 << 32),
    late=st.sampled_from([0.0, 0.05, 0.5]),
    skipped=st.sampled_from([0.0, 0.02, 0.5]),
    held=st.sampled_from([256, 20, 7]),
    second=st.lists(
        st.tuples(st.sampled_from([55, 145, 235, 325]), st.integers(1, 300)),
        max_size=4,
        unique_by=lambda sent: sent[0],
    ),
    early=st.lists(
        st.tuples(st.sampled_from([5, 55, 155, 205, 265]), st.sampled_from([90, 100, 120, 10**6])),
        max_size=4,
        unique_by=sum,
    ),
)
def test_a_replay_takes_in_what_the_agent_took_in(
    mode: str,
    seed: int,
    late: float,
    skipped: float,
    held: int,
    second: list[tuple[int, int]],
    early: list[tuple[int, int]],
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("quadriga.agents.inbox._HELD", held)
        patch.setattr("quadriga.agents.inbox.AHEAD_MS", 100)
        log, taken = simulate_walk(mode, seed, late, skipped, second, early)
        patch.undo()
        patch.setattr("quadriga.agents.inbox.AHEAD_MS", 100)
        steps = handed_over(mode, log)
    assert not [step.missing for step in steps if step.missing]
    again = [(step.tick, list_messages(step.inputs)) for step in steps if step.inputs is not None]
    assert again == taken


def test_lock_step_without_trouble_needs_no_record_at_all() -> None:
    log, taken = simulate_walk("lockstep", 1, 0.0, 0.0)
    assert not log.records
    assert sum(len(found) for _, found in taken) > 50


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
@pytest.mark.parametrize(
    ("source", "order"),
    [
        (("measurement", "r1"), (130, 0)),
        (("measurement", "r3"), (200, 0)),
        (("plan", "r3"), (5, 0)),
        (("reference", "operator"), (200, 0)),
    ],
)
def test_what_the_recorder_lost_is_named_at_the_step_that_took_it_in(
    mode: str, source: Source, order: Order
) -> None:
    log, taken = simulate_walk(mode, 2, 0.0, 0.0)
    step = next(tick for tick, found in taken if (source, order) in found)
    del log.received[source][order]
    missing = [(step.tick, step.missing) for step in handed_over(mode, log) if step.missing]
    assert missing == [(step, (format_message_id(source, order),))]


def test_a_lost_state_and_a_lost_record_are_named() -> None:
    log, _ = simulate_walk("realtime", 3, 0.0, 0.0)
    lost = log.records.pop(sorted(log.records)[7])
    before = sorted(log.records)[6]
    del log.states[400]
    missing = [(step.tick, step.missing) for step in handed_over("realtime", log) if step.missing]
    assert missing[0][0] == before + 1 <= lost.tick
    assert "1 of inputs of r2 between ticks" in missing[0][1][0]
    assert (400, ("state of r2 at tick 400",)) in missing


@pytest.mark.parametrize("known", [(), (0, 1, 2, 5), (0, 1 << 40)])
def test_forged_ticks_do_not_ask_for_years_of_steps(known: tuple[int, ...]) -> None:
    config, agent = AGENTS["realtime"]
    log = AgentLog(last=1 << 41)
    for tick in known:
        log.states[tick].append(encode(standing(tick)))
    inputs = RecordedInputs(config, agent, Inbox(config, "r2", agent.peers), log)
    steps = [step.tick for step in inputs.steps()]
    assert len(steps) < 3000
    assert {*known} <= {*steps}
    assert steps == sorted(steps)
