"""Between bus and agent: dropped and counted, held until due, sorted."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadriga.agents.inbox import Inbox, format_message_id, list_messages, parse_message_id
from quadriga.agents.planning.interface import NOTHING, Expected
from quadriga.agents.step_io import Inputs
from quadriga.shared.codec import encode
from quadriga.shared.config.load import load
from quadriga.shared.messages import (
    Consumed,
    EStop,
    Event,
    Measurement,
    Message,
    Plan,
    Reference,
    Reset,
    SafeStop,
    Status,
    Truth,
)
from quadriga.shared.topics import ESTOP, REQUESTS, TABLE, Topic
from tests.a1 import standing


def arrivals(
    mode: str = "lockstep", estimator: str = "kalman", planner: str = "distributed"
) -> Inbox:
    config = load(
        None,
        {
            "team.robots": 3,
            "world.mode": mode,
            "estimator.kind": estimator,
            "planner.kind": planner,
        },
    )
    return Inbox(config, "r2", ("r1", "r3") if planner == "distributed" else ())


def measurement(tick: int) -> Measurement:
    return Measurement(tick, tick, np.zeros(12), np.zeros(6), np.ones(4))


def plan(step: int) -> Plan:
    return Plan(40 * step, 0, step, np.zeros((25, 12)), np.zeros((25, 6)), "solved", {}, 0)


def reference(tick: int) -> Reference:
    return Reference(tick, tick, 0.5, 0.0, 0.0, 0.26)


def feed(box: Inbox, *messages: tuple[str, Message]) -> None:
    for key, message in messages:
        box.take(f"team/{key}", encode(message))


def test_subscribes_to_what_it_needs_and_no_more() -> None:
    alone = {"team/r2/state", "team/reference", "team/sim/event"}
    alone |= {f"team/{word.name}" for word in REQUESTS}
    peers = {f"team/{r}/{t}" for r in ("r1", "r3") for t in ("plan", "measurement")}
    assert {*arrivals(planner="none").topics} == alone
    assert {*arrivals(planner="centralised").topics} == alone | {"team/r2/plan"}
    statuses = {"team/r1/status", "team/r3/status"}
    assert {*arrivals("realtime", planner="none").topics} == alone | statuses
    assert {*arrivals().topics} == alone | peers
    assert {*arrivals(estimator="truth").topics} == alone | peers | {"team/sim/truth"}


@pytest.mark.parametrize("topic", TABLE, ids=lambda topic: topic.name)
@pytest.mark.parametrize("payload", [b"", b"\x81\xa1x\x01", bytes(2_000_000)], ids=len)
def test_malformed_messages_on_any_key_are_dropped_and_counted(
    topic: Topic, payload: bytes
) -> None:
    box = arrivals(estimator="truth")
    for robot in ("r1", "r2", "r3") if topic.per_robot else ("",):
        box.take(topic.key("team", robot), payload)
    refused = 3 if topic.per_robot else topic is not ESTOP  # which whoever sends there wants
    assert sum(box.counters.values()) == refused
    assert all(name in (f"dropped_{topic.name}", "dropped_foreign") for name in box.counters)
    assert box.pop_state() is None
    inputs = box.pop_inputs(standing(0), Expected((0, 0), 0, 0, True))
    assert (inputs.plans, inputs.measurements, inputs.references) == ((), (), ())
    assert inputs.estop == (EStop(0, 0, "unreadable") if topic is ESTOP else None)
    assert inputs.truth is None


def pop_ticks(box: Inbox) -> list[int]:
    found = iter(box.pop_state, None)
    return [state.tick for state in found if state is not None]


def test_the_newest_state_counts_in_whatever_order_and_the_others_are_counted() -> None:
    for order in permutations((4, 5, 6)):
        box = arrivals()
        feed(box, *(("r2/state", standing(tick)) for tick in order))
        assert box.has_state
        assert pop_ticks(box) == [6]
        assert box.counters["states_passed_over"] == 2
        feed(box, ("r2/state", standing(5)), ("r2/state", standing(6)))
        assert pop_ticks(box) == []


def test_the_state_at_which_a_sample_ends_is_not_passed_over() -> None:
    box = arrivals()
    feed(box, *(("r2/state", standing(tick)) for tick in (9, 10, 11, 12)))
    assert pop_ticks(box) == [10, 12]
    assert box.counters["states_passed_over"] == 2
    feed(box, *(("r2/state", standing(tick)) for tick in (20, 21, 30, 31)))
    assert pop_ticks(box) == [30, 31]


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
@pytest.mark.parametrize("lead", [1001, 10_000, (1 << 42) - 3000])
def test_what_is_of_a_time_far_ahead_is_refused_and_nobody_is_taken_to_have_spoken(
    mode: str, lead: int
) -> None:
    box, step = arrivals(mode, estimator="truth"), -(-(2000 + lead) // 40)
    feed(box, ("r2/state", standing(2000)))
    early: list[tuple[str, Message]] = [
        ("r1/plan", plan(step)), ("r1/plan", replace(plan(step), tick=2000)),
        ("r3/measurement", measurement(2000 + lead)), ("reference", reference(2000 + lead)),
        ("sim/truth", replace(truth(("r1", "r2", "r3"), 3), tick=2000 + lead)),
    ]  # fmt: skip
    for _ in range(400):
        feed(box, *early)
    named = {"plan": 800, "measurement": 400, "reference": 400, "sim/truth": 400}
    assert box.counters == {f"ahead_{name}": count for name, count in named.items()}
    assert box.refused
    assert not box.received["plan", "r1"]
    expected = Expected((50, 0), 2000, 2000, True)
    assert len(box.missing_sources(2000, expected)) == 6
    feed(
        box,
        ("r1/plan", plan(50)),
        ("r3/measurement", measurement(2000)),
        ("reference", reference(2000)),
        ("reference", reference(3000)),
    )
    inputs = box.pop_inputs(standing(2000), expected)
    assert [found.step for _, found in inputs.plans] == [50]
    assert [sample.tick for _, sample in inputs.measurements] == [2000]
    due = [2000] if mode == "lockstep" else [2000, 3000]
    assert [found.tick for found in inputs.references] == due


def test_the_order_of_arrival_does_not_matter() -> None:
    messages: list[tuple[str, Message]] = [
        ("r1/measurement", measurement(10)), ("r3/measurement", measurement(10)),
        ("r3/plan", plan(1)), ("r1/plan", plan(1)),
    ]  # fmt: skip
    seen = []
    for order in permutations(messages):
        box = arrivals()
        feed(box, *order, ("r1/measurement", measurement(20)))
        inputs = box.pop_inputs(standing(80), Expected(plan=(1, 0), measurement_tick=40))
        seen.append([(name, message.tick) for name, message in inputs.measurements])
        assert [name for name, _ in inputs.plans] == ["r1", "r3"]
    assert seen == [[("r1", 10), ("r1", 20), ("r3", 10)]] * len(seen)


def test_lock_step_hands_over_at_the_tick_that_awaits_and_never_earlier() -> None:
    box = arrivals()
    feed(box, ("r1/plan", plan(1)), ("r1/plan", plan(2)), ("r1/measurement", measurement(80)))
    feed(box, ("reference", reference(0)), ("reference", reference(100)))
    assert box.pop_inputs(standing(41), NOTHING).plans == ()
    handed_over = []
    for tick, expected in ((80, Expected((1, 0), 40, 0)), (120, Expected((2, 0), 80, 100))):
        inputs = box.pop_inputs(standing(tick), expected)
        plans, samples = [p.step for _, p in inputs.plans], [m.tick for _, m in inputs.measurements]
        handed_over.append((plans, samples, [r.tick for r in inputs.references]))
    assert handed_over == [([1], [], [0]), ([2], [80], [100])]


def test_real_time_hands_over_all_that_has_come_once() -> None:
    box = arrivals("realtime")
    walks, stands = (
        Status(tick, 0, mode, "", "", {}, {}, np.zeros(0), np.zeros(0))
        for tick, mode in ((100, "walk"), (103, "stand"))
    )
    feed(box, ("r1/plan", plan(9)), ("r3/measurement", measurement(990)))
    feed(box, ("r3/status", walks), ("r1/status", stands))
    inputs = box.pop_inputs(standing(104), NOTHING)
    assert (len(inputs.plans), len(inputs.measurements)) == (1, 1)
    assert [(n, said.mode) for n, said in inputs.statuses] == [("r1", "stand"), ("r3", "walk")]
    assert not inputs.bare
    assert box.pop_inputs(standing(105), NOTHING).bare


def test_who_owes_what() -> None:
    box = arrivals(estimator="truth")
    expected = Expected(plan=(1, 0), measurement_tick=40, reference_tick=0, truth=True)
    behind = {("plan", "r3"), ("measurement", "r3"), ("sim/truth", "sim")}
    on_time = {("plan", "r1"), ("measurement", "r1"), ("reference", "operator")}
    assert box.missing_sources(80, expected) == behind | on_time
    assert box.missing_sources(80, NOTHING) == frozenset()
    feed(box, ("r1/plan", plan(1)), ("r3/plan", plan(0)), ("reference", reference(0)))
    feed(box, ("r1/measurement", measurement(40)), ("r3/measurement", measurement(30)))
    assert box.missing_sources(80, expected) == behind


def test_an_emergency_stop_and_the_end_are_never_held_back() -> None:
    box = arrivals()
    feed(box, ("estop", EStop(5, 5, "trip")), ("sim/event", Event(5, 5, "push", "r1", "", "push")))
    assert not box.ended
    assert box.pop_inputs(standing(6), NOTHING).estop == EStop(5, 5, "trip")
    feed(box, ("sim/event", Event(7, 7, "stop", "", "", "signal")))
    feed(box, ("sim/event", Event(8, 8, "fall", "", "", "fall")))
    assert box.ended


def test_a_flood_is_bounded_and_counted() -> None:
    box = arrivals()
    feed(box, ("r2/state", standing(19_999)), ("r2/state", standing(20_000)))
    feed(box, *(("r1/measurement", measurement(10 * k)) for k in range(1000)))
    most = 256 + 300 // 10  # what is measured while the team stands belongs to no flood
    assert box.counters["flooded_measurement"] == 1000 - most
    feed(box, ("r3/measurement", measurement(0)))
    assert box.received["measurement", "r3"] == 1
    assert box.counters["flooded_measurement"] == 1000 - most, "nobody pays for another's flood"
    taken = box.pop_inputs(standing(5000), Expected(measurement_tick=10**6))
    assert len(taken.measurements) == most + 1
    feed(box, *(("r1/measurement", measurement(10 * k)) for k in range(1000, 1000 + most)))
    assert box.counters["flooded_measurement"] == 1000 - most, "there is room again"


@pytest.mark.parametrize(("robots", "stand_ms"), [(10, 300), (3, 10_000)])
def test_nothing_that_is_measured_during_the_stand_is_refused(robots: int, stand_ms: int) -> None:
    """In lock-step nobody asks for it before the first planning step."""
    config = load(None, {"team.robots": robots, "gait.stand_ms": stand_ms})
    peers = [f"r{k}" for k in range(2, robots + 1)]
    box, last = Inbox(config, "r1", peers), stand_ms + 10
    feed(box, ("r1/state", standing(last - 1)), ("r1/state", standing(last)))
    for peer in peers:
        feed(box, *((f"{peer}/measurement", measurement(t)) for t in range(10, last + 1, 10)))
    assert not box.refused
    assert not box.missing_sources(last, Expected(measurement_tick=last))


@pytest.mark.parametrize(
    "change", [{"vx": 50.0}, {"vy": -0.6}, {"wz": 1.01}, {"height": 5.0}, {"height": 0.0}]
)
def test_a_reference_that_nobody_may_configure_is_dropped(change: dict[str, Any]) -> None:
    box = arrivals()
    feed(box, ("reference", replace(reference(0), **change)))
    assert box.counters["dropped_reference"] == 1
    feed(box, ("reference", replace(reference(0), vx=1.2, vy=0.5, wz=-1.0, height=0.32)))
    assert box.counters["dropped_reference"] == 1
    assert len(box.pop_inputs(standing(0), Expected(reference_tick=0)).references) == 1


def truth(robots: tuple[str, ...], rows: int, quat: float = 0.5) -> Truth:
    zero, quats, feet = np.zeros((rows, 3)), np.full((rows, 4), quat), np.zeros((rows, 4, 3))
    return Truth(0, 0, robots, zero, quats, zero, zero, feet, np.zeros(0), np.zeros(0))


@pytest.mark.parametrize(
    "wrong",
    [
        truth(("r1",), 1),
        truth(("r1", "r2", "r3"), 1),
        truth((), 3),
        truth(("r1", "r3", "r4"), 3),
        truth(("r1", "r2", "r3"), 3, 0.0),
        truth(("r1", "r2", "r3"), 3, 1e3),
    ],
)
def test_a_truth_that_says_nothing_of_the_robot_is_dropped(wrong: Truth) -> None:
    box, expected = arrivals(estimator="truth"), Expected(truth=True)
    feed(box, ("sim/truth", wrong))
    assert box.counters["dropped_sim/truth"] == 1
    assert box.pop_inputs(standing(0), expected).truth is None
    feed(box, ("sim/truth", truth(("r1", "r2", "r3"), 3)))
    assert box.pop_inputs(standing(0), expected).truth is not None


@pytest.mark.parametrize(
    ("field", "number"),
    [
        ("q_joint", 1e300),
        ("q_joint", -8.0),
        ("v_joint", 3500.0),
        ("tau_joint", 400.0),
        ("imu_quat_wxyz", 10.0),
        ("imu_gyro", -3500.0),
        ("imu_accel", 2e4),
        ("foot_force", 1e5),
    ],
)
def test_a_state_that_no_sensor_can_tell_is_dropped(field: str, number: float) -> None:
    box, good = arrivals(), standing(5)
    numbers = getattr(good, field).copy()
    numbers[-1] = number
    changed: Any = {field: numbers}
    feed(box, ("r2/state", replace(good, **changed)))
    assert pop_ticks(box) == []
    assert box.counters["dropped_state"] == 1
    feed(box, ("r2/state", replace(good, imu_quat_wxyz=np.zeros(4))))
    assert pop_ticks(box) == [5], "the robot's own still counts, even without an attitude"


def test_a_release_that_comes_twice_is_one_and_another_is_another() -> None:
    box = arrivals()
    resets = []
    for message in (Reset(5, 5, "ann"), Reset(5, 5, "ann"), Reset(6, 6, "ann")):
        feed(box, ("reset", message))
        resets.append(box.pop_inputs(standing(7), NOTHING).reset)
    assert resets == [Reset(5, 5, "ann"), None, Reset(6, 6, "ann")]
    feed(box, ("stop", SafeStop(5, 5, "ann", False)), ("stop", SafeStop(5, 5, "ann", False)))
    assert box.pop_inputs(standing(8), NOTHING).stop == SafeStop(5, 5, "ann", False)


@pytest.mark.parametrize("announced", [3, 7, 2**41])
def test_an_announced_end_is_forgotten_once_time_goes_on(announced: int) -> None:
    """A stranger may announce one, of any time: afterwards a pause of the team is no end."""
    box = arrivals()
    feed(box, ("r2/state", standing(5)), ("sim/event", Event(announced, 7, "stop", "", "", "end")))
    assert box.ended
    box.pop_state()
    for tick in range(6, 1100):
        feed(box, ("r2/state", standing(tick)))
        box.pop_state()
    assert not box.ended


def test_a_plant_of_one_robot_may_go_on_for_as_long_as_plants_may_be_apart() -> None:
    overrides = {"team.plant_per_robot": True, "team.yokes": "none", "world.mode": "realtime"}
    box = Inbox(load(None, {"bus.clock_timeout": 0.5, **overrides}), "r2", ("r1",))
    feed(box, ("r2/state", standing(5)), ("sim/event", Event(4, 4, "stop", "", "", "end")))
    feed(box, ("r2/state", standing(504)))
    assert box.ended
    feed(box, ("r2/state", standing(505)))
    assert not box.ended


# ---- what an agent took in is told where no rule tells it, and only there

PLAN = Plan(480, 0, 12, np.zeros((25, 12)), np.zeros((25, 6)), "solved", {}, 1)
SAMPLE = Measurement(480, 0, np.zeros(12), np.zeros(6), np.ones(4))
REFERENCE = Reference(500, 0, 0.5, 0.0, 0.0, 0.26)


def of_pair(mode: str) -> Inbox:
    """Of r2 that takes in r1's plans."""
    return Inbox(load(None, {"world.mode": mode}), "r2", ("r1",))


def full(tick: int) -> Inputs:
    return Inputs(
        standing(tick), (("r1", SAMPLE),), (("r1", PLAN),), (REFERENCE,), EStop(7, 7, "tripped")
    )


@given(
    topic=st.sampled_from(["plan", "measurement", "reference", "estop", "sim/truth"]),
    sender=st.sampled_from(["r1", "r10", "planner", "operator", "anyone", "sim"]),
    first=st.integers(0, 1 << 40),
    second=st.integers(0, 9),
)
def test_references_lead_back(topic: str, sender: str, first: int, second: int) -> None:
    order = (first, second if topic == "plan" else 0)
    assert parse_message_id(format_message_id((topic, sender), order)) == ((topic, sender), order)


@given(text=st.text(max_size=20))
def test_foreign_references_are_no_error(text: str) -> None:
    found = parse_message_id(text)
    assert found is None or len(found) == 2


def test_in_real_time_all_that_was_taken_in_is_listed() -> None:
    said = Status(500, 0, "walk", "", "", {}, {}, np.zeros(0), np.zeros(0))
    told = replace(full(541), statuses=(("r1", said),))
    taken = ["plan:r1:12.1", "measurement:r1:480", "reference:operator:500", "status:r1:500"]
    taken.append("estop:anyone:7")
    record = of_pair("realtime").record(540, told, NOTHING)
    assert record == Consumed(541, 541_000_000, 0, 0, tuple(taken), ())
    assert [parse_message_id(text) for text in taken] == list_messages(told)


def test_a_step_that_took_in_the_next_state_alone_needs_no_record() -> None:
    box = of_pair("realtime")
    assert box.record(-1, Inputs(standing(0)), NOTHING) is None
    passed = box.record(0, Inputs(standing(3)), NOTHING)
    assert passed is not None
    assert (passed.number, passed.passed, passed.taken) == (0, 2, ())
    again = box.record(3, full(4), NOTHING)
    assert again is not None
    assert again.number == 1


def test_lock_step_tells_only_the_unusual() -> None:
    box = of_pair("lockstep")
    box.take("team/r1/plan", encode(PLAN))
    box.take("team/r1/measurement", encode(SAMPLE))
    expected = Expected((12, 1), 480)
    usual = box.pop_inputs(standing(520), expected)
    assert len(list_messages(usual)) == 2
    late = Inputs(standing(521), plans=(("r1", PLAN),))  # the same once more: it was due before
    stopped = Inputs(standing(524), estop=EStop(0, 0, ""))
    told = [
        (519, usual, expected, None),
        (520, late, NOTHING, (("plan:r1:12.1",), ())),
        (521, Inputs(standing(522)), Expected((13, 0)), ((), ("plan/r1",))),
        (522, Inputs(standing(523)), NOTHING, None),
        (523, stopped, NOTHING, (("estop:anyone:0",), ())),
        (524, Inputs(standing(526)), NOTHING, ((), ())),  # a state was passed over
    ]
    for last, inputs, awaited, expected_record in told:
        record = box.record(last, inputs, awaited)
        assert (None if record is None else (record.taken, record.owed)) == expected_record
